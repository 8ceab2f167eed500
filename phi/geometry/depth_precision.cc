#include "phi/geometry/depth_precision.h"

#include <cmath>

#include <tbb/parallel_for.h>

#include "phi/base/wide_vectors.h"

namespace phi {

DepthPrecision::DepthPrecision(const Camera& reference, const std::vector<const Camera*>& sources)
    : reference_(MakeRayModel(reference.pinhole)) {
  for (const Camera* source : sources) sources_.push_back(MakeRelativeView(reference, *source));
}

namespace {

// Square of how far the point of (u, v) moves in a source view when its depth changes by a share; whether the view's image contains
// it. Without branches, so that a loop over a row becomes vector instructions.
struct Motion {
  float squared;
  bool is_seen;
};

inline Motion MotionIn(const RelativeView& view, float u, float v, float w) {
  const Vec3f far = view.a * Vec3f{u, v, 1};  // at w = 0
  const float x = far.x + w * view.b.x, y = far.y + w * view.b.y, z = far.z + w * view.b.z;
  const bool is_seen =
      (z > 0) & (x >= 0) & (y >= 0) & (x <= z * view.source.width) & (y <= z * view.source.height);
  // d(x / z) / d(log w)
  const float scale = w / (z * z);
  const float du = (view.b.x * z - x * view.b.z) * scale, dv = (view.b.y * z - y * view.b.z) * scale;
  return {du * du + dv * dv, is_seen};
}

// Adds what a view tells of the points.
PHI_WIDE_VECTORS void AddMotions(const RelativeView& view, const float* u, const float* v, const float* inverse_depths,
                                 std::size_t size, float* squares, float* num_seeing) {
  const RelativeView own = view;
  for (std::size_t i = 0; i < size; ++i) {
    const Motion motion = MotionIn(own, u[i], v[i], inverse_depths[i]);
    squares[i] += motion.is_seen ? motion.squared : 0.0f;
    num_seeing[i] += motion.is_seen ? 1.0f : 0.0f;
  }
}

float DeviationOf(float squares, float num_seeing) {
  return squares > 0 ? kMatchDeviation / std::sqrt(squares / num_seeing) : 0;
}

}  // namespace

float DepthPrecision::RelativeDeviation(float u, float v, float depth) const {
  const float w = 1 / depth;
  float squares = 0, num_seeing = 0;
  for (const RelativeView& view : sources_) {
    const Motion motion = MotionIn(view, u, v, w);
    if (!motion.is_seen) continue;
    squares += motion.squared;
    ++num_seeing;
  }
  return DeviationOf(squares, num_seeing);
}

void DepthPrecision::FindRelativeDeviations(const float* u, const float* v, const float* depth, std::size_t size,
                                            float* deviations) const {
  std::vector<float> inverse_depths(size), squares(size, 0), num_seeing(size, 0);
  for (std::size_t i = 0; i < size; ++i) inverse_depths[i] = 1 / depth[i];
  for (const RelativeView& source : sources_) {
    AddMotions(source, u, v, inverse_depths.data(), size, squares.data(), num_seeing.data());
  }
  for (std::size_t i = 0; i < size; ++i) deviations[i] = DeviationOf(squares[i], num_seeing[i]);
}

Array2D<float> DepthPrecision::RelativeDeviations(const PlaneMap& map) const {
  auto deviations = Array2D<float>::Uninitialized(map.width(), map.height());
  tbb::parallel_for(0, map.height(), [&](int y) {
    const int width = map.width();
    std::vector<float> u(width), depth(width);
    const std::vector<float> v(width, static_cast<float>(y) + 0.5f);
    for (int x = 0; x < width; ++x) {
      u[x] = static_cast<float>(x) + 0.5f;
      depth[x] = map(x, y).depth;
    }
    FindRelativeDeviations(u.data(), v.data(), depth.data(), static_cast<std::size_t>(width), &deviations(0, y));
    for (int x = 0; x < width; ++x) {
      if (!(depth[x] > 0)) deviations(x, y) = 0;
    }
  });
  return deviations;
}

}  // namespace phi
