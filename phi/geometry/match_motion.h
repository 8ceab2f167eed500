// How far a point moves in a source view when its depth changes: what matching can tell of a depth.
#pragma once

#include "phi/geometry/device_camera.h"

namespace phi {

// Standard deviation of a match, pixels of a source view. A window of 121 samples with noise of a grey level reaches
// this; tolerances are made of several of them.
inline constexpr float kMatchDeviation = 0.15f;

// Square of how far the point of (u, v) moves in a source view when its depth changes by a share; whether the view's image contains
// it. Without branches, so that a loop over a row becomes vector instructions.
struct MatchMotion {
  float squared;
  bool is_seen;
};

// At inverse depth w.
PHI_HD MatchMotion MotionIn(const RelativeView& view, float u, float v, float w) {
  const Vec3f far = view.a * Vec3f{u, v, 1};  // at w = 0
  const float x = far.x + w * view.b.x, y = far.y + w * view.b.y, z = far.z + w * view.b.z;
  const bool is_seen =
      (z > 0) & (x >= 0) & (y >= 0) & (x <= z * view.source.width) & (y <= z * view.source.height);
  // d(x / z) / d(log w)
  const float scale = w / (z * z);
  const float du = (view.b.x * z - x * view.b.z) * scale, dv = (view.b.y * z - y * view.b.z) * scale;
  return {du * du + dv * dv, is_seen};
}

// Of a depth, relative, by the views that see its point: as one of them tells it, whose motion is their root mean square. 0: none sees it.
PHI_HD float MatchDeviation(float sum_of_squares, float num_seeing) {
  const float deviation = kMatchDeviation / sqrtf(sum_of_squares / num_seeing);
  return sum_of_squares > 0 ? deviation : 0;
}

// Of the depth of (u, v), K's coordinates, by `num_views` source views. See DepthPrecision.
PHI_HD float MatchDeviationOf(const RelativeView* views, int num_views, float u, float v, float depth) {
  const float w = 1 / depth;
  float squares = 0, num_seeing = 0;
  for (int j = 0; j < num_views; ++j) {
    const MatchMotion motion = MotionIn(views[j], u, v, w);
    if (!motion.is_seen) continue;
    squares += motion.squared;
    num_seeing += 1;
  }
  return MatchDeviation(squares, num_seeing);
}

}  // namespace phi
