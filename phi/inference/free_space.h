// What the other views' measured depths say about a depth that was inferred. One that lies there too confirms it; a
// surface behind it was seen through it, so nothing is there. Inferred depths say neither: views that rest on the same
// measurements repeat each other's errors.
#pragma once

#include <cmath>
#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/filtering/filled_value.h"
#include "phi/geometry/device_camera.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {

// The point at inverse depth w on the ray of reference pixel (u, v), in the source image, homogeneous; z is the depth
// in the source camera times w.
PHI_HD Vec3f ProjectInverseDepth(const RelativeView& view, float u, float v, float w) {
  return view.a * Vec3f{u, v, 1.0f} + w * view.b;
}

inline constexpr float kSeenThroughMargin =
    0.02f;  // a surface counts as behind from here on, relative to its depth
inline constexpr float kAgreementTolerance = 0.01f;  // a surface within this confirms, relative to the depth

// Of all source views together.
struct DepthEvidence {
  bool confirmed = false, seen_through = false;

  // Of an inferred depth in the filled mask; 0: refused, nothing can be there.
  PHI_HD std::uint8_t FilledValue() const {
    return seen_through ? 0 : confirmed ? kInferredConfirmed : kInferredAlone;
  }
};

// Adds what one source view knows about the point at inverse depth w on the ray of pixel (u, v). `source_depths`:
// measured only; without data, or with a hole there, it knows nothing.
PHI_HD void AddEvidence(const RelativeView& view, ArrayView2D<const float> source_depths, float u, float v,
                        float w, DepthEvidence* evidence) {
  if (source_depths.data == nullptr) return;
  const Vec3f p = ProjectInverseDepth(view, u, v, w);
  if (!(p.z > 0)) return;
  const float su = p.x / p.z, sv = p.y / p.z;
  if (!(su >= 0 && sv >= 0 && su < source_depths.width && sv < source_depths.height)) return;
  const float measured = source_depths(static_cast<int>(su), static_cast<int>(sv));
  if (!(measured > 0)) return;
  evidence->seen_through |= p.z < (1 - kSeenThroughMargin) * measured * w;
  evidence->confirmed |= fabsf(p.z - measured * w) < kAgreementTolerance * p.z;
}

}  // namespace phi
