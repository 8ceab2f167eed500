// What a pixel's code needs of cameras: plain floats, relative to the reference camera, so that world
// coordinates of any size (geo-registered scenes) never reach single precision.
#pragma once

#include "phi/base/vec.h"

namespace phi {

struct Pinhole;
struct Camera;

struct ImagePoint {
  float u = 0, v = 0;  // pixels, K's coordinates
};

// Reference intrinsics. Rays have z = 1, so X = depth * ray.
struct RayModel {
  float fx = 1, fy = 1, cx = 0, cy = 0;
  int width = 0, height = 0;

  // (u, v) in K's coordinates (pixel centres at half-integers).
  PHI_HD Vec3f Ray(float u, float v) const { return {(u - cx) / fx, (v - cy) / fy, 1.0f}; }
  // Of a point in the camera's frame, before the camera (z > 0).
  PHI_HD ImagePoint Project(Vec3f p) const { return {fx * p.x / p.z + cx, fy * p.y / p.z + cy}; }
};

// Source camera relative to the reference camera. With q the plane's inverse-depth coefficients (see
// plane_hypothesis.h), the homography that takes a reference pixel (u, v, 1) to the source image is a + b *
// q^T.
struct RelativeView {
  Mat3f rotation;     // source_from_reference
  Vec3f translation;  // source_from_reference, world units
  Mat3f a;            // K_source * rotation * K_reference^-1
  Vec3f b;            // K_source * translation
  RayModel source;    // intrinsics of the source image
};

RayModel MakeRayModel(const Pinhole& pinhole);
RelativeView MakeRelativeView(const Camera& reference, const Camera& source);

}  // namespace phi
