#include "phi/filtering/neighbor_planes.h"

#include <cmath>

#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

struct Planes {
  const float *x, *y, *z, *offset;
};

PHI_WIDE_VECTORS void Count(const float* depth, const float* ray_x, float ray_y, const float* tolerance, Planes planes, int size,
                            std::int32_t* counts) {
  for (int i = 0; i < size; ++i) {
    const float here = depth[i] * (planes.x[i] * ray_x[i] + planes.y[i] * ray_y + planes.z[i]);
    counts[i] += std::fabs(planes.offset[i] - here) < tolerance[i] * std::fabs(here);
  }
}

}  // namespace

void CountAgreeing(const PlaneRow& pixels, float ray_y, const PlaneRow& planes, int shift, int begin, int end,
                   std::vector<std::int32_t>* counts) {
  const int width = static_cast<int>(counts->size());
  begin = std::max(begin, -shift), end = std::min(end, width - shift);
  if (begin >= end) return;
  const int other = begin + shift;
  Count(&pixels.depth[begin], &pixels.ray_x[begin], ray_y, &pixels.tolerance[begin],
        {&planes.normal_x[other], &planes.normal_y[other], &planes.normal_z[other], &planes.offset[other]}, end - begin,
        &(*counts)[begin]);
}

}  // namespace phi
