// Which planes a region takes: those through its own anchors, the scene's, those of other views' regions, or those that stand along
// the scene's directions.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "phi/inference/anchor_cells.h"
#include "phi/inference/region_plane.h"
#include "phi/inference/region_sky.h"
#include "phi/inference/scene_directions.h"
#include "phi/inference/source_regions.h"
#include "phi/inference/spot_views.h"

namespace phi {

struct PlaneChoiceLimits {
  int min_cells;     // on a plane
  double min_share;  // of the region's cells on a plane
  double
      min_apart;  // relative inverse depth: a cell so far behind a plane contradicts it; so far apart two planes are two
  double reach_deviations;   // of the cells' places: how far a plane reaches
  double min_deviation;      // of a cell's place, pixels
  double unlike_weight = 0;  // of spots that other views show unlike, against the share of cells on the plane
  double source_weight = 0;  // of the other views' cells
  SkyLimits sky = {};
  double full_reflected = 0;  // share of mirrored cells (mirror.h); 0: no plane is a mirror
  double aligned_weight = 0;  // of standing along a direction of the scene, against the share of cells on the plane
  double agreement_weight = 0;  // of what the other views' regions chose, against the share of cells on the plane
  float continued_weight = 1;  // of the cells of regions that continue a region, in other views
};

// What is known of a region.
struct RegionEvidence {
  std::vector<AnchorCell> cells;           // of its anchors
  std::span<const Spot> spots = {};        // of its pixels without one
  const SpotViews* views = nullptr;        // null: brightness is not asked
  std::span<const SourceRegions> sources = {};  // of the source views
  const SceneDirections* directions = nullptr;  // null: the scene has none
  bool may_be_sky = true;                       // too little of it carries anchors to say otherwise
};

// What cells say of a plane, from -1 to 1: on - behind.
struct Verdict {
  double on = 0, behind = 0;          // shares of one view's cells, by weight
  double num_on = 0, num_behind = 0;  // cells
};

struct PlaneCandidate {
  RegionPlane plane;
  Verdict others = {};   // of the other views' regions together
  double agreement = 0;  // with what those regions chose, summed over views
};

struct ChosenPlanes {
  PlanesOfRegion planes{};
  Sky sky = Sky::kNot;  // why there is none
  bool is_mirror = false;  // the first plane: what lies behind it is its reflection
  // For choosing again: the likeliest first planes, among them the one that was taken, before it was fitted to what lies on it.
  std::vector<PlaneCandidate> likeliest = {};
  std::ptrdiff_t taken = -1;  // of `likeliest`; -1: none
};

// A plane counts by the share of the region's cells on it, each the more the nearer it lies, less those behind it, but for what it
// reflects: surfaces before a wall are no reason against the wall. Cells count by their weights. To this comes the same of the other
// views' regions that the spots fall in if they lie on the plane, from each view the share of the spots that do; less the share of
// the spots that other views show unlike. What stands along a direction of the scene is likelier beforehand, by a constant; such
// planes are sought through the cells of all views that offer a plane, for one view's may lie off a wall by what hangs on it. `own`:
// the region's planes, as far as they are there. The planes that are chosen come first; the rest are not there.
ChosenPlanes ChoosePlanes(RegionEvidence region, const PlanesOfRegion& own, std::span<const ImagePlane> scene,
                          const PlaneChoiceLimits& limits);

// Of a region that chose before, without `agreement_weight`: it may take another of its likeliest planes, or one that the sources'
// regions chose. To the first plane's score comes how far those agree: from each view the share of the region's spots, if they lie on
// the plane, that fall in regions which chose it. nullopt: the plane that it took stays the best.
std::optional<ChosenPlanes> ChoosePlanesAgain(RegionEvidence region, const ChosenPlanes& before, const PlaneChoiceLimits& limits);

}  // namespace phi
