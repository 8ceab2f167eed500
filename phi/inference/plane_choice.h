// Which planes a region takes: those through its own anchors, or the scene's.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "phi/inference/anchor_cells.h"
#include "phi/inference/line_hypothesis.h"
#include "phi/inference/region_plane.h"

namespace phi {

struct PlaneChoiceLimits {
  int min_cells;             // on a plane
  double min_share;          // of the region's cells on a plane
  double min_apart;          // relative inverse depth: a cell so far behind a plane contradicts it; so far apart two planes are two
  double reach_deviations;   // of the cells' places: how far a plane of the scene reaches
  double min_deviation;      // of a cell's place, pixels
};

// `cells`: of the region's anchors. A plane counts by the cells on it, each the more the nearer it lies, less those behind
// it: surfaces before a wall are no reason against the wall. `own`: the region's planes, as far as they are there. The
// planes that are chosen come first; the rest are not there.
std::array<RegionPlane, kPlanesPerRegion> ChoosePlanes(std::vector<AnchorCell> cells,
                                                       const std::array<RegionPlane, kPlanesPerRegion>& own,
                                                       std::span<const ImagePlane> scene, const PlaneChoiceLimits& limits);

}  // namespace phi
