#include "phi/geometry/depth_precision.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

#include "phi/base/wide_vectors.h"

namespace phi {

DepthPrecision::DepthPrecision(const Camera& reference, const std::vector<const Camera*>& sources)
    : reference_(MakeRayModel(reference.pinhole)) {
  for (const Camera* source : sources) sources_.push_back(MakeRelativeView(reference, *source));
}

namespace {

struct Points {
  const float *u, *v, *inverse_depths;
  std::size_t size;
};

// Of each point over the views so far.
struct MotionSums {
  float *squares, *num_seeing;
};

// Adds what a view tells of the points.
PHI_WIDE_VECTORS void AddMotions(const RelativeView& view, Points points, MotionSums sums) {
  const RelativeView own = view;
  for (std::size_t i = 0; i < points.size; ++i) {
    const MatchMotion motion = MotionIn(own, points.u[i], points.v[i], points.inverse_depths[i]);
    sums.squares[i] += motion.is_seen ? motion.squared : 0.0f;
    sums.num_seeing[i] += motion.is_seen ? 1.0f : 0.0f;
  }
}

PHI_WIDE_VECTORS void SetDeviations(const float* __restrict squares, const float* __restrict num_seeing, std::size_t size,
                                    float* __restrict deviations) {
  for (std::size_t i = 0; i < size; ++i) deviations[i] = MatchDeviation(squares[i], num_seeing[i]);
}

}  // namespace

float DepthPrecision::RelativeDeviation(float u, float v, float depth) const {
  return MatchDeviationOf(sources_.data(), static_cast<int>(sources_.size()), u, v, depth);
}

void DepthPrecision::FindRelativeDeviations(const float* u, const float* v, const float* depth, std::size_t size,
                                            float* deviations) const {
  constexpr std::size_t kBatch = 512;  // stays in the nearest cache
  for (std::size_t begin = 0; begin < size; begin += kBatch) {
    const std::size_t count = std::min(kBatch, size - begin);
    std::array<float, kBatch> inverse_depths, squares{}, num_seeing{};
    for (std::size_t i = 0; i < count; ++i) inverse_depths[i] = 1 / depth[begin + i];
    for (const RelativeView& source : sources_) {
      AddMotions(source, {u + begin, v + begin, inverse_depths.data(), count}, {squares.data(), num_seeing.data()});
    }
    SetDeviations(squares.data(), num_seeing.data(), count, deviations + begin);
  }
}

Array2D<float> DepthPrecision::RelativeDeviations(const PlaneMap& map, const Mask& wanted) const {
  auto deviations = Array2D<float>::Uninitialized(map.width(), map.height());
  tbb::parallel_for(0, map.height(), [&](int y) {
    const auto width = static_cast<std::size_t>(map.width());
    std::vector<int> columns(width);
    std::vector<float> u(width), depth(width), found(width);
    std::size_t count = 0;
    for (int x = 0; x < map.width(); ++x) {  // each is written, and the next one over those that are not asked for
      columns[count] = x;
      u[count] = static_cast<float>(x) + 0.5f;
      depth[count] = map(x, y).depth;
      count += std::size_t{wanted(x, y) != 0} & std::size_t{depth[count] > 0};
    }
    const std::vector<float> v(count, static_cast<float>(y) + 0.5f);
    FindRelativeDeviations(u.data(), v.data(), depth.data(), count, found.data());
    std::fill_n(&deviations(0, y), map.width(), 0.0f);
    for (std::size_t i = 0; i < count; ++i) deviations(columns[i], y) = found[i];
  });
  return deviations;
}

}  // namespace phi
