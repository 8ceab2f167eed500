// The surface of a region in which windows tell nothing, by its shade. Shade stays on a surface that is not glossy, so the region
// lies where the source views show it as bright as the reference does. Its inverse depth is taken for a square in the image's
// coordinates, which a plane is, and a column, a vault or a fold of cloth nearly.
#pragma once

#include <optional>
#include <span>

#include "phi/inference/anchor_cells.h"
#include "phi/inference/region_plane.h"
#include "phi/inference/spot.h"
#include "phi/inference/spot_views.h"

namespace phi {

struct ShadeLimits {
  double max_left_share = 0.7;  // of the differences of brightness that the start leaves: more is no reason to leave it
  // Where cells do not tell the surface from the start, shade speaks alone:
  double min_change = 2;  // of the brightness with a per cent of depth, grey levels
  double max_left = 2;    // of the differences of brightness, mean, grey levels: with min_change, a per cent of depth
  double max_moved = 4;   // times as far as the start's differences ask for: farther off they are small by chance
};

// Found from `start` by Levenberg and Marquardt's method; reaches as far as `reach_deviations` standard deviations of the spots' places
// from their mean. `cells`: of the region's anchors, which the search does not look at, so that they are a second witness. nullopt: the
// views do not tell, or the start is as good.
std::optional<RegionPlane> SurfaceByShade(const SpotViews& views, std::span<const Spot> spots, std::span<const AnchorCell> cells,
                                          const RegionPlane& start, double reach_deviations, const ShadeLimits& limits = {});

}  // namespace phi
