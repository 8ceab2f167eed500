// Whether another view measured the depth that was inferred. Inferred depths confirm nothing: views that rest on the same
// measurements repeat each other's errors.
//
// Where a thing ends its view's map is good to a pixel only: where the background was measured, the eight pixels around may still show
// the thing.
#pragma once

#include "phi/base/array2d.h"
#include "phi/geometry/depth_agreement.h"
#include "phi/geometry/device_camera.h"
#include "phi/measurement.h"

namespace phi {

// The point at inverse depth w on the ray of reference pixel (u, v), in the source image, homogeneous; z is the depth
// in the source camera times w.
PHI_HD Vec3f ProjectInverseDepth(const RelativeView& view, float u, float v, float w) {
  return view.a * Vec3f{u, v, 1.0f} + w * view.b;
}

// Whether the source view measured the point at inverse depth w on the ray of pixel (u, v). Without data, or without evidence at the
// pixel where the point lands, it knows nothing.
PHI_HD bool Confirms(const RelativeView& view, const MeasuredDepthsView& source, float u, float v, float w) {
  if (!source.IsKnown()) return false;
  const Vec3f p = ProjectInverseDepth(view, u, v, w);
  if (!(p.z > 0)) return false;
  const float su = p.x / p.z, sv = p.y / p.z;
  if (!(su >= 0 && sv >= 0 && su < source.depths.width && sv < source.depths.height)) return false;
  const int x = static_cast<int>(su), y = static_cast<int>(sv);
  const float own = source.Evidence(x, y);
  if (!(own > 0)) return false;
  if (DepthsAgree(p.z, own * w, kSameDepth)) return true;
  // Only against its own word are the pixels around asked: on a slanted surface one of them agrees with many a depth.
  if (!LiesBefore(p.z, own * w)) return false;
  for (int i = 0; i < 9; ++i) {
    const int nx = x + i % 3 - 1, ny = y + i / 3 - 1;
    const float beside = source.depths.Contains(nx, ny) ? source.Evidence(nx, ny) : 0;
    if (beside > 0 && DepthsAgree(p.z, beside * w, kSameDepth)) return true;
  }
  return false;
}

}  // namespace phi
