#include "phi/geometry/depth_precision.h"

#include <cmath>

#include <tbb/parallel_for.h>

namespace phi {

DepthPrecision::DepthPrecision(const Camera& reference, const std::vector<const Camera*>& sources)
    : reference_(MakeRayModel(reference.pinhole)) {
  for (const Camera* source : sources) sources_.push_back(MakeRelativeView(reference, *source));
}

float DepthPrecision::RelativeDeviation(float u, float v, float depth) const {
  const float w = 1 / depth;
  float squares = 0;
  int num_seeing = 0;
  for (const RelativeView& view : sources_) {
    const Vec3f far = view.a * Vec3f{u, v, 1};  // at w = 0
    const float x = far.x + w * view.b.x, y = far.y + w * view.b.y, z = far.z + w * view.b.z;
    if (!(z > 0 && x >= 0 && y >= 0 && x <= z * view.source.width && y <= z * view.source.height)) continue;
    // d(x / z) / d(log w)
    const float scale = w / (z * z);
    const float du = (view.b.x * z - x * view.b.z) * scale, dv = (view.b.y * z - y * view.b.z) * scale;
    squares += du * du + dv * dv;
    ++num_seeing;
  }
  return squares > 0 ? kMatchDeviation / std::sqrt(squares / num_seeing) : 0;
}

Array2D<float> DepthPrecision::RelativeDeviations(const PlaneMap& map) const {
  auto deviations = Array2D<float>::Uninitialized(map.width(), map.height());
  tbb::parallel_for(0, map.height(), [&](int y) {
    for (int x = 0; x < map.width(); ++x) {
      const float depth = map(x, y).depth;
      deviations(x, y) = depth > 0 ? RelativeDeviation(x + 0.5f, y + 0.5f, depth) : 0.0f;
    }
  });
  return deviations;
}

}  // namespace phi
