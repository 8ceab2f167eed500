// Whether another view measured the depth that was inferred. Inferred depths confirm nothing: views that rest on the same
// measurements repeat each other's errors.
//
// Where a thing ends its view's map is good to a pixel only: where the background was measured, the eight pixels around may still show
// the thing.
#pragma once

#include "phi/base/array2d.h"
#include "phi/geometry/depth_agreement.h"
#include "phi/inference/shown_point.h"
#include "phi/measurement.h"

namespace phi {

// Whether the source view measured the point at inverse depth w on the ray of pixel (u, v). Without data, or without evidence at the
// pixel where the point lands, it knows nothing.
PHI_HD bool Confirms(const RelativeView& view, const MeasuredDepthsView& source, float u, float v, float w) {
  if (!source.IsKnown()) return false;
  ShownPoint p;
  if (!FindInImage(ProjectInverseDepth(view, u, v, w), source.depths.width, source.depths.height, &p)) return false;
  const int x = p.x(), y = p.y();
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
