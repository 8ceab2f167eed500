#include "phi/filtering/neighbor_planes.h"

#include <cmath>

#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

// The pixels that ask, and the neighbours' planes.
struct Pixels {
  const float *depth, *ray_x, *tolerance;
  float ray_y;
};

struct Planes {
  const float *x, *y, *z, *offset;
};

PHI_WIDE_VECTORS void Count(Pixels pixels, Planes planes, int size, std::int32_t* counts) {
  for (int i = 0; i < size; ++i) {
    const float here = pixels.depth[i] * (planes.x[i] * pixels.ray_x[i] + planes.y[i] * pixels.ray_y + planes.z[i]);
    counts[i] += std::fabs(planes.offset[i] - here) < pixels.tolerance[i] * std::fabs(here);
  }
}

}  // namespace

void CountAgreeing(const PlaneRow& pixels, const PlaneRow& planes, int shift, int begin, int end, std::vector<std::int32_t>* counts) {
  const int width = static_cast<int>(counts->size());
  begin = std::max(begin, -shift), end = std::min(end, width - shift);
  if (begin >= end) return;
  const int other = begin + shift;
  Count({&pixels.depth[begin], &pixels.ray_x[begin], &pixels.tolerance[begin], pixels.ray_y},
        {&planes.normal_x[other], &planes.normal_y[other], &planes.normal_z[other], &planes.offset[other]}, end - begin,
        &(*counts)[begin]);
}

}  // namespace phi
