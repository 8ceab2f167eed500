// Where an image shows a point.
#pragma once

#include "phi/geometry/device_camera.h"

namespace phi {

// The point at inverse depth w on the ray of reference pixel (u, v), in the source image, homogeneous; z is the depth in the source
// camera times w.
PHI_HD Vec3f ProjectInverseDepth(const RelativeView& view, float u, float v, float w) {
  return view.a * Vec3f{u, v, 1.0f} + w * view.b;
}

// (u, v) in K's coordinates.
PHI_HD bool IsInImage(float u, float v, int width, int height) {
  return u >= 0 && v >= 0 && u < static_cast<float>(width) && v < static_cast<float>(height);
}

struct ShownPoint {
  float u = 0, v = 0;  // pixels, K's coordinates
  float z = 0;         // of the homogeneous point: the depth in that camera, times the inverse depth that it was projected with

  // The pixel that it lies in.
  PHI_HD int x() const { return static_cast<int>(u); }
  PHI_HD int y() const { return static_cast<int>(v); }
};

// `p`: homogeneous. False: it lies behind the camera or beside the image, which has that size.
PHI_HD bool FindInImage(Vec3f p, int width, int height, ShownPoint* shown) {
  if (!(p.z > 0)) return false;
  const float u = p.x / p.z, v = p.y / p.z;
  if (!IsInImage(u, v, width, height)) return false;
  *shown = {u, v, p.z};
  return true;
}

}  // namespace phi
