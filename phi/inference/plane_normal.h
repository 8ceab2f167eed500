// Normals of filled pixels (the paper's Eq. 10 and its replacement).
#pragma once

#include "phi/geometry/device_camera.h"
#include "phi/inference/plane_fit.h"
#include "phi/options.h"

namespace phi {

// Unit normal facing the camera, from the inverse-depth plane around pixel (x, y) (array indices).
//
// With 1 / z = q . (u, v, 1) and z * ray = X, q . K * X = 1: the plane's normal is parallel to K^T q.
PHI_HD Vec3f NormalOfInverseDepthPlane(const RayModel& k, const InverseDepthPlane& plane, int x, int y) {
  const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
  const float at_principal_point = plane.At(k.cx - u, k.cy - v);
  // normal . ray = 1 / depth > 0 before the sign flip, so the flipped normal faces the camera.
  return Normalized({-plane.slope_x * k.fx, -plane.slope_y * k.fy, -at_principal_point});
}

// The normal opposite to the viewing ray of pixel (x, y): what remains when there is no surface around it.
PHI_HD Vec3f FrontalNormal(const RayModel& k, int x, int y) {
  return -1.0f * Normalized(k.Ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
}

// Eq. 10 as printed, but unit: the cross product of the central differences of the 4-neighbours' points. Needs all
// four; the frontal normal otherwise.
PHI_HD Vec3f NormalOfFourNeighbours(const RayModel& k, ArrayView2D<const float> inverse_depth, int x, int y) {
  if (x < 1 || y < 1 || x + 1 >= inverse_depth.width || y + 1 >= inverse_depth.height)
    return FrontalNormal(k, x, y);
  const float left = inverse_depth(x - 1, y), right = inverse_depth(x + 1, y);
  const float up = inverse_depth(x, y - 1), down = inverse_depth(x, y + 1);
  if (!(left > 0 && right > 0 && up > 0 && down > 0)) return FrontalNormal(k, x, y);
  const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
  const Vec3f horizontal = (1 / left) * k.Ray(u - 1, v) - (1 / right) * k.Ray(u + 1, v);
  const Vec3f vertical = (1 / up) * k.Ray(u, v - 1) - (1 / down) * k.Ray(u, v + 1);
  const Vec3f normal = Normalized(Cross(vertical, horizontal));
  return Dot(normal, k.Ray(u, v)) < 0 ? normal : -1.0f * normal;
}

// Normal of a filled pixel, where no region's plane is known (FinishRegionPixels in region_pixels.h); inverse_depth: measured
// and filled pixels together.
PHI_HD Vec3f FilledNormal(const RayModel& k, ArrayView2D<const float> inverse_depth, int x, int y,
                          Formulas formulas) {
  if (formulas == Formulas::kPaper) return NormalOfFourNeighbours(k, inverse_depth, x, y);
  const InverseDepthPlane plane = FitInverseDepthPlane(inverse_depth, x, y);
  return plane.count > 0 ? NormalOfInverseDepthPlane(k, plane, x, y) : FrontalNormal(k, x, y);
}

}  // namespace phi
