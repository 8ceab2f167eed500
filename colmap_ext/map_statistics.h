// What a depth, normal or cost map holds, and how it compares with the exact one.
#pragma once

#include <cstdint>
#include <string>

#include "phi/base/array2d.h"
#include "phi/base/vec.h"

namespace colmap_ext {

// Of the valid values.
struct MapStatistics {
  std::int64_t num_pixels = 0, num_valid = 0;
  float low = 0, median = 0, high = 0;  // 2nd, 50th and 98th percentile

  double ValidPercent() const { return num_pixels > 0 ? 100.0 * num_valid / num_pixels : 0; }
};

MapStatistics DepthStatistics(const phi::Array2D<float>& depth);  // valid: finite and > 0
MapStatistics CostStatistics(const phi::Array2D<float>& cost);    // valid: finite
// Of the angle between the normal and the camera's axis towards the camera, degrees.
MapStatistics NormalStatistics(const phi::Array2D<phi::Vec3f>& normals);

// Counts of pixels; sums over images add up.
struct MapAccuracy {
  std::int64_t num_truth = 0;   // pixels with truth
  std::int64_t num_kept = 0;    // of these, pixels with a value in the map
  std::int64_t num_within = 0;  // of these, pixels whose error is at most the limit

  void Add(const MapAccuracy& other);
  double KeptPercent() const { return num_truth > 0 ? 100.0 * num_kept / num_truth : 0; }
  double WithinPercent() const { return num_kept > 0 ? 100.0 * num_within / num_kept : 0; }
};

// Truth of another size is read at the nearest pixel. max_error: of |depth - truth| / truth.
MapAccuracy CompareDepth(const phi::Array2D<float>& depth, const phi::Array2D<float>& truth,
                         double max_error);
// max_error: angle, degrees.
MapAccuracy CompareNormals(const phi::Array2D<phi::Vec3f>& normals, const phi::Array2D<phi::Vec3f>& truth,
                           double max_error);

}  // namespace colmap_ext
