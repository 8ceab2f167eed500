// How many of the planes around each pixel agree with its depth, in vector instructions.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/array2d.h"
#include "phi/geometry/device_camera.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {

// A neighbour agrees when its plane, carried on to the pixel, differs from the pixel's depth by less than the greater of
// these: a share of the depth, and standard deviations of what matching can tell there: about one of the difference of two
// depths, so that two in three of the right neighbours agree. By the share alone, right neighbours contradict each other
// where baselines are short.
inline constexpr float kMaxNeighborError = 0.003f, kMaxNeighborDeviations = 1.5f;

inline constexpr int kNeighborRadius = 2;  // 5 x 5 pixels are asked, one or more pixels apart
inline constexpr int kNumNeighbors = (2 * kNeighborRadius + 1) * (2 * kNeighborRadius + 1) - 1;

// A row's planes n . X = offset, and its pixels' own: what loops over x read in vector instructions.
struct PlaneRow {
  std::vector<float> normal_x, normal_y, normal_z, offset;  // offset NaN: no depth
  std::vector<float> depth, ray_x;
  std::vector<float> tolerance;  // of the depth

  PlaneRow(const RayModel& rays, const PlaneMap& map, const Array2D<float>& deviations, int y)
      : normal_x(map.width()),
        normal_y(map.width()),
        normal_z(map.width()),
        offset(map.width()),
        depth(map.width()),
        ray_x(map.width()),
        tolerance(map.width()) {
    for (int x = 0; x < map.width(); ++x) {
      const PlaneHypothesis& h = map(x, y);
      const Vec3f ray = rays.Ray(x + 0.5f, y + 0.5f);
      normal_x[x] = h.normal.x;
      normal_y[x] = h.normal.y;
      normal_z[x] = h.normal.z;
      offset[x] = h.depth > 0 ? h.depth * Dot(h.normal, ray) : std::numeric_limits<float>::quiet_NaN();
      depth[x] = h.depth;
      ray_x[x] = ray.x;
      tolerance[x] = std::max(kMaxNeighborError, kMaxNeighborDeviations * deviations(x, y));
    }
  }
};

// Neighbours of the pixels of one row.
struct NeighborCounts {
  std::vector<std::int32_t> asked, agreeing;

  // The pixel itself is no neighbour, and always agrees.
  explicit NeighborCounts(int width) : asked(width, -1), agreeing(width, -1) {}

  // Adds the neighbours `shift` columns to the right in the row `planes`. A plane meets a pixel's ray at offset / (n . ray),
  // the pixel's depth where offset = depth (n . ray).
  void Add(const PlaneRow& pixels, float ray_y, const PlaneRow& planes, int shift) {
    const int width = static_cast<int>(asked.size());
    const int begin = std::max(0, -shift), end = std::min(width, width - shift);
    const float *nx = planes.normal_x.data() + shift, *ny = planes.normal_y.data() + shift;
    const float *nz = planes.normal_z.data() + shift, *offset = planes.offset.data() + shift;
    const float *depth = pixels.depth.data(), *ray_x = pixels.ray_x.data();
    const float* tolerance = pixels.tolerance.data();
    std::int32_t *num_asked = asked.data(), *num_agreeing = agreeing.data();
    for (int x = begin; x < end; ++x) {
      const float here = depth[x] * (nx[x] * ray_x[x] + ny[x] * ray_y + nz[x]);
      num_asked[x] += offset[x] == offset[x];
      num_agreeing[x] += std::fabs(offset[x] - here) < tolerance[x] * std::fabs(here);
    }
  }
};

// Calls function(y, counts) for all rows, bands of them in parallel: of the neighbours of the row's pixels, `spacing` pixels apart.
// `deviations`: DepthPrecision::RelativeDeviations of the map, at least where it has depth.
template <class Function>
void ForNeighborCounts(const RayModel& rays, const PlaneMap& map, const Array2D<float>& deviations,
                       int spacing, const Function& function) {
  constexpr int kBandRows = 64;
  const int reach = kNeighborRadius * spacing, height = map.height();
  tbb::parallel_for(0, (height + kBandRows - 1) / kBandRows, [&](int band) {
    const int begin = band * kBandRows, end = std::min(begin + kBandRows, height);
    const int first = std::max(begin - reach, 0), last = std::min(end - 1 + reach, height - 1);
    std::vector<PlaneRow> rows;
    for (int y = first; y <= last; ++y) rows.emplace_back(rays, map, deviations, y);
    for (int y = begin; y < end; ++y) {
      NeighborCounts counts(map.width());
      const PlaneRow& pixels = rows[y - first];
      const float ray_y = rays.Ray(0.5f, y + 0.5f).y;
      for (int v = y - reach; v <= y + reach; v += spacing) {
        if (v < first || v > last) continue;
        for (int shift = -reach; shift <= reach; shift += spacing) counts.Add(pixels, ray_y, rows[v - first], shift);
      }
      function(y, counts);
    }
  });
}

}  // namespace phi
