// Geometric guidance of an estimation that has the source views' maps (second and later passes): a hypothesis pays for
// disagreeing with what the source view found at its projection.
#pragma once

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {

// Cost per pixel of forward-backward reprojection error, and the error where it saturates. Occluded pixels and
// outliers of the source map must not forbid a good match.
inline constexpr float kGuidanceCostPerPixel = 0.2f;
inline constexpr float kGuidanceMaxPixels = 3.0f;

// In [0, kGuidanceCostPerPixel * kGuidanceMaxPixels]. (u, v), depth: the hypothesis in the reference image.
PHI_HD float GuidanceCost(const RayModel& reference, const RelativeView& view,
                          ArrayView2D<const float> source_depths, float u, float v, float depth) {
  constexpr float kMax = kGuidanceCostPerPixel * kGuidanceMaxPixels;
  const Vec3f x_source = view.rotation * (depth * reference.Ray(u, v)) + view.translation;
  if (!(x_source.z > 0)) return kMax;
  const auto [su, sv] = view.source.Project(x_source);
  if (!(su >= 0 && sv >= 0 && su < source_depths.width && sv < source_depths.height)) return kMax;
  const float source_depth = source_depths(static_cast<int>(su), static_cast<int>(sv));
  if (!(source_depth > 0)) return kMax;
  const Vec3f back =
      TransposedTimes(view.rotation, source_depth * view.source.Ray(su, sv) - view.translation);
  if (!(back.z > 0)) return kMax;
  const ImagePoint met = reference.Project(back);
  const float du = met.u - u, dv = met.v - v;
  return kGuidanceCostPerPixel * Min(sqrtf(du * du + dv * dv), kGuidanceMaxPixels);
}

}  // namespace phi
