// What seems to lie behind a glossy door, floor or table is what stands before it: matching finds the reflection in all views alike,
// as if the plane were a window.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "phi/inference/anchor_cells.h"
#include "phi/inference/convex_hull.h"
#include "phi/inference/image_plane.h"
#include "phi/inference/spot.h"
#include "phi/inference/spot_views.h"

namespace phi {

inline constexpr std::size_t kFewTold = 16;  // of fewer cells behind it views tell too little of a mirror

// Relative inverse depth. Behind a plane that leans out of its wall lies the wall; its mirror image lies on what hangs before it.
inline constexpr double kClearlyBehind = 0.1;

// Of some cells: the places of those on a plane, and those behind it.
struct PlaneSides {
  std::vector<Place> on;
  std::size_t num_behind = 0;
  std::vector<AnchorCell> clearly_behind;  // of them

  // `min_apart`: relative inverse depth, from which on a cell lies behind.
  void Add(const ImagePlane& plane, const AnchorCell& cell, double min_apart) {
    if (IsOn(plane, cell)) {
      on.push_back({cell.x, cell.y});
    } else if (IsBehind(plane, cell, min_apart)) {
      ++num_behind;
      if (IsBehind(plane, cell, kClearlyBehind)) clearly_behind.push_back(cell);
    }
  }
};

// Of the cells behind the plane, how much of what they say against it is its reflection, from 0 to 1. Mirrored at the plane, what is
// reflected lies where views measured it, and oftener than by chance; what is mirrored onto what hangs on the plane is none. So those
// clearly behind are asked, and where they are many the others go with them.
// Cells on the plane lie all around the region's `spots`: what is seen through a doorway ends at its floor. `full_share`: of the cells of
// which the views tell, that lie so, less those that do by chance; from there on all is reflection.
double ReflectedShare(PlaneSides sides, std::span<const Spot> spots, const ImagePlane& plane, double full_share, const SpotViews& views);

}  // namespace phi
