#include "phi/filtering/neighbor_planes.h"

#include <cmath>
#include <cstddef>
#include <limits>

#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

// A PlaneRow's arrays from the row's first pixel on, apart.
struct RowArrays {
  float *__restrict normal_x, *__restrict normal_y, *__restrict normal_z, *__restrict offset;
  float *__restrict depth, *__restrict ray_x, *__restrict tolerance;
};

// By value what is read in the loop, so that the compiler sees that the arrays change none of it.
PHI_WIDE_VECTORS void Fill(const RayModel rays, const PlaneHypothesis* __restrict planes, const float* __restrict deviations, int y,
                           int size, const RowArrays row) {
  for (int x = 0; x < size; ++x) {
    const PlaneHypothesis& h = planes[x];
    const Vec3f ray = rays.Ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    const float offset = h.depth * Dot(h.normal, ray);
    row.normal_x[x] = h.normal.x;
    row.normal_y[x] = h.normal.y;
    row.normal_z[x] = h.normal.z;
    row.offset[x] = h.depth > 0 ? offset : std::numeric_limits<float>::quiet_NaN();
    row.depth[x] = h.depth;
    row.ray_x[x] = ray.x;
    row.tolerance[x] = NeighborTolerance(deviations[x]);
  }
}

// The pixels that ask, and the neighbours' planes.
struct Pixels {
  const float *depth, *ray_x, *tolerance;
  float ray_y;
};

struct Planes {
  const float *x, *y, *z, *offset;
};

PHI_WIDE_VECTORS void Count(const Pixels pixels, const Planes planes, int spacing, int size, std::int32_t* __restrict counts) {
  for (int i = 0; i < size; ++i) {
    std::int32_t count = 0;
    for (int step = -kNeighborRadius; step <= kNeighborRadius; ++step) {
      const int k = i + step * spacing;
      const float here = pixels.depth[i] * (planes.x[k] * pixels.ray_x[i] + planes.y[k] * pixels.ray_y + planes.z[k]);
      count += std::fabs(planes.offset[k] - here) < pixels.tolerance[i] * std::fabs(here) ? 1 : 0;
    }
    counts[i] += count;
  }
}

}  // namespace

PlaneRow::PlaneRow(const RayModel& rays, const PlaneMap& map, const Array2D<float>& deviations, int y, int margin)
    : margin(margin), ray_y(rays.Ray(0.5f, static_cast<float>(y) + 0.5f).y) {
  const auto size = static_cast<std::size_t>(map.width()), whole = size + 2 * static_cast<std::size_t>(margin);
  for (std::vector<float>* array : {&normal_x, &normal_y, &normal_z}) array->resize(whole);
  offset.resize(whole, std::numeric_limits<float>::quiet_NaN());
  for (std::vector<float>* array : {&depth, &ray_x, &tolerance}) array->resize(size);
  Fill(rays, &map(0, y), &deviations(0, y), y, map.width(),
       {&normal_x[margin], &normal_y[margin], &normal_z[margin], &offset[margin], depth.data(), ray_x.data(), tolerance.data()});
}

void CountAgreeing(const PlaneRow& pixels, const PlaneRow& planes, int spacing, int begin, int end, std::vector<std::int32_t>* counts) {
  const int first = planes.margin + begin;
  Count({&pixels.depth[begin], &pixels.ray_x[begin], &pixels.tolerance[begin], pixels.ray_y},
        {&planes.normal_x[first], &planes.normal_y[first], &planes.normal_z[first], &planes.offset[first]}, spacing, end - begin,
        &(*counts)[begin]);
}

}  // namespace phi
