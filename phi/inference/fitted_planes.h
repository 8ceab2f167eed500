// Planes that a region's own points carry: RANSAC in inverse depth, refined by least squares.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/base/random.h"
#include "phi/base/rules.h"
#include "phi/inference/region_anchors.h"
#include "phi/inference/region_plane.h"

namespace phi {

struct RegionFitLimits {
  int min_anchors, max_draws;  // that a plane rests on; for a plane
  double min_share;            // of the region's anchors not yet explained
  double min_apart;            // relative inverse depth: within this, two planes are one but for noise, or meet
  double min_spread;           // standard deviation across the inliers' narrow side, pixels
  double reach_deviations;     // see RegionPlane::SetReach

  explicit RegionFitLimits(const Rules& rules);
};

// Up to two; the others are not there. Points by ascending hash. Draws are keyed by `key` and the region.
PlanesOfRegion FitPlanes(const RegionFitLimits& limits, std::vector<RegionPoint> points, RandomKey key, std::uint64_t region);

}  // namespace phi
