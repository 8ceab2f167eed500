// When two depths are one surface's, and when one surface lies before another. All tolerances of that kind that are no option
// stand here; they are shares of the depth. Those that follow from the geometry of the views (DepthPrecision) stand where they
// are used: neighbor_agreement.h, region_planes.cc.
#pragma once

#include <cmath>

#include "phi/base/hd.h"

namespace phi {

// What two views measured of one spot differs by less. The defaults of the filter and of fusion, which are options, are the same.
inline constexpr float kSameDepth = 0.01f;
// From here on a surface lies behind another one: of what hides a point, of points that others hide, of a background that was
// measured beside a thing. Between this and kSameDepth nothing is said.
inline constexpr float kDepthGap = 0.02f;
// Pixels beside each other in one map are one surface's, and a plane is fitted to them together; of what a first plane predicts.
inline constexpr float kSameSurface = 0.02f;
// The two sides of a hole are two surfaces from here on. Wide, since one that is seen at a slant changes across a hole.
inline constexpr float kDepthEdge = 0.05f;

// Whether a depth agrees with `own` within a tolerance. Both may be scaled by one factor.
PHI_HD bool DepthsAgree(float own, float other, float tolerance) {
  return fabsf(own - other) < tolerance * own;
}

// Whether `near` lies before `far`, beyond a gap.
PHI_HD bool LiesBefore(float near, float far, float gap = kDepthGap) { return near < (1 - gap) * far; }

}  // namespace phi
