#include "phi/inference/scored_anchors.h"

#include <algorithm>
#include <cstdint>

#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

struct PlacedAnchor {
  float x, y;
  double w, tolerance;
};

PHI_WIDE_VECTORS std::int64_t CountOn(const ImagePlane plane, const float* x, const float* y, const double* w,
                                      const double* tolerance, std::size_t size) {
  std::int64_t count = 0;
  for (std::size_t i = 0; i < size; ++i) count += IsOn(plane, PlacedAnchor{x[i], y[i], w[i], tolerance[i]}) ? 1 : 0;
  return count;
}

}  // namespace

std::size_t ScoredAnchors::CountInliers(const ImagePlane& plane, std::size_t needed) const {
  constexpr std::size_t kBatch = 128;
  std::size_t count = 0;
  for (std::size_t i = 0; i < size() && count + size() - i > needed; i += kBatch) {
    const std::size_t batch = std::min(kBatch, size() - i);
    count += static_cast<std::size_t>(CountOn(plane, &x_[i], &y_[i], &w_[i], &tolerance_[i], batch));
  }
  return count;
}

}  // namespace phi
