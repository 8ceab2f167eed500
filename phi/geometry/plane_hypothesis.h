// A pixel's plane hypothesis, and its inverse-depth form.
//
// The plane through X = depth * ray with normal n satisfies n . X = const, so along any pixel (u, v) inverse
// depth is affine: 1 / z(u, v) = q . (u, v, 1) with q = K^-T n / (depth * n . ray).
#pragma once

#include "phi/base/array2d.h"
#include "phi/base/vec.h"
#include "phi/geometry/device_camera.h"

namespace phi {

// normal: unit, reference camera frame, facing the camera (normal . ray < 0). depth: camera z, > 0; 0 = none.
struct alignas(16) PlaneHypothesis {
  Vec3f normal;
  float depth = 0;
};

using PlaneMap = Array2D<PlaneHypothesis>;
using DepthMap = Array2D<float>;  // a plane map's depths alone, a quarter of its bytes

DepthMap DepthsOf(const PlaneMap& map);

// Steeper hypotheses than about 85 degrees have windows of a fraction of a pixel in depth: never a
// measurement.
PHI_HD bool FacesCamera(Vec3f normal, Vec3f ray) { return Dot(normal, ray) < -0.08f * Norm(ray); }

// Coefficients q of inverse depth, per pixel coordinate of K: 1 / z = q . (u, v, 1). (u, v): the hypothesis's
// pixel.
PHI_HD Vec3f InverseDepthCoefficients(const RayModel& k, float u, float v, const PlaneHypothesis& h) {
  const float offset = h.depth * Dot(h.normal, k.Ray(u, v));
  const float s = 1.0f / offset;
  const float qx = s * h.normal.x / k.fx, qy = s * h.normal.y / k.fy;
  return {qx, qy, s * h.normal.z - qx * k.cx - qy * k.cy};
}

// Depth at (u, v) of the plane that `h` at (u0, v0) describes. Not positive where the plane is behind the
// camera.
PHI_HD float PlaneDepthAt(const RayModel& k, const PlaneHypothesis& h, float u0, float v0, float u, float v) {
  return h.depth * Dot(h.normal, k.Ray(u0, v0)) / Dot(h.normal, k.Ray(u, v));
}

// Homography column form: source = a * (u, v, 1) + b * (q . (u, v, 1)), homogeneous.
PHI_HD Mat3f PlaneHomography(const RelativeView& view, Vec3f q) {
  Mat3f h;
  const float* a = view.a.m;
  h.m[0] = a[0] + view.b.x * q.x;
  h.m[1] = a[1] + view.b.x * q.y;
  h.m[2] = a[2] + view.b.x * q.z;
  h.m[3] = a[3] + view.b.y * q.x;
  h.m[4] = a[4] + view.b.y * q.y;
  h.m[5] = a[5] + view.b.y * q.z;
  h.m[6] = a[6] + view.b.z * q.x;
  h.m[7] = a[7] + view.b.z * q.y;
  h.m[8] = a[8] + view.b.z * q.z;
  return h;
}

}  // namespace phi
