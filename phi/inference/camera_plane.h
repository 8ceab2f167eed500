// Planes of an image in the frame of its camera. `Intrinsics`: Pinhole, or RayModel where floats are exact enough.
#pragma once

#include <Eigen/Core>

#include "phi/inference/image_plane.h"

namespace phi {

// Through array indices (x, y); z = 1.
template <typename Intrinsics>
Eigen::Vector3d RayOf(double x, double y, const Intrinsics& k) {
  return {(x + 0.5 - k.cx) / k.fx, (y + 0.5 - k.cy) / k.fy, 1};
}

// n with n . X = 1 for the points X of the plane.
template <typename Intrinsics>
Eigen::Vector3d NormalOf(const ImagePlane& plane, const Intrinsics& k) {
  return {plane.b * k.fx, plane.c * k.fy, plane.InverseDepth(k.cx - 0.5, k.cy - 0.5)};
}

// The plane n . X = 1.
template <typename Intrinsics>
ImagePlane PlaneOf(const Eigen::Vector3d& n, const Intrinsics& k) {
  const double b = n.x() / k.fx, c = n.y() / k.fy;
  return {n.z() - b * (k.cx - 0.5) - c * (k.cy - 0.5), b, c};
}

}  // namespace phi
