// What the other views' measured depths say about a depth that was inferred. One that lies there too confirms it; a
// surface behind it was seen through it, so nothing is there. Inferred depths say neither: views that rest on the same
// measurements repeat each other's errors.
//
// A view can be wrong: where a thing ends its map is good to a pixel only, and some measured depths are mistakes. So a view
// sees through a point where all that it measured at the pixel and the eight around it lies behind, and views are counted.
#pragma once

#include <cmath>
#include <cstdint>

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

// Of all source views together.
struct DepthEvidence {
  int num_confirming = 0, num_seeing_through = 0;  // views

  // As many on either side leave the depth where it is: that two measure the same depth by mistake is rarer than that one
  // is mistaken.
  PHI_HD bool SeenThrough() const { return num_seeing_through > num_confirming; }

  // Of an inferred depth; kNone: refused, nothing can be there.
  PHI_HD PixelState State() const {
    if (SeenThrough()) return PixelState::kNone;
    return num_confirming > 0 ? PixelState::kInferredConfirmed : PixelState::kInferredAlone;
  }
};

// Of a source view's measured depth, for ProjectInverseDepth's `p` at inverse depth w.
PHI_HD bool LiesBehind(Vec3f p, float measured, float w, float scale) {
  return p.z < (1 - scale * kDepthGap) * measured * w;
}
PHI_HD bool Agrees(Vec3f p, float measured, float w, float scale) {
  return DepthsAgree(p.z, measured * w, scale * kSameDepth);
}

// Adds what one source view knows about the point at inverse depth w on the ray of pixel (u, v). Without
// data, or without evidence at the pixel where the point lands, it knows nothing. scale: of both tolerances.
PHI_HD void AddEvidence(const RelativeView& view, const MeasuredDepthsView& source, float u, float v, float w,
                        DepthEvidence* evidence, float scale = 1) {
  if (!source.IsKnown()) return;
  const Vec3f p = ProjectInverseDepth(view, u, v, w);
  if (!(p.z > 0)) return;
  const float su = p.x / p.z, sv = p.y / p.z;
  if (!(su >= 0 && sv >= 0 && su < source.depths.width && sv < source.depths.height)) return;
  const int x = static_cast<int>(su), y = static_cast<int>(sv);
  const float own = source.Evidence(x, y);
  if (!(own > 0)) return;
  bool confirms = Agrees(p, own, w, scale);
  // Only against its own word are the pixels around asked: on a slanted surface one of them agrees with many a depth.
  const bool own_lies_behind = LiesBehind(p, own, w, scale);
  bool all_lie_behind = own_lies_behind;
  for (int i = 0; own_lies_behind && i < 9; ++i) {
    const int nx = x + i % 3 - 1, ny = y + i / 3 - 1;
    const float beside = source.depths.Contains(nx, ny) ? source.Evidence(nx, ny) : 0;
    if (!(beside > 0)) continue;
    all_lie_behind = all_lie_behind && LiesBehind(p, beside, w, scale);
    confirms = confirms || Agrees(p, beside, w, scale);
  }
  evidence->num_confirming += confirms;
  evidence->num_seeing_through += all_lie_behind;
}

}  // namespace phi
