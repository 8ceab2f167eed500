// Whether a region is the sky. Cells of roofs, trees and houses lie around it, and planes through them; but it is infinitely far away,
// and other views show it there.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "phi/inference/anchor_cells.h"
#include "phi/inference/image_plane.h"
#include "phi/inference/spot.h"
#include "phi/inference/spot_views.h"

namespace phi {

// Of a region: why no plane was chosen.
enum class Sky : std::uint8_t {
  kNot,
  kMayBe,  // too little says that it is not, and what other views show of the region is on no plane
  kSeen,   // other views show it infinitely far or do not show what a plane foretells, or it shines (light_sources.h)
};

struct SkyLimits {
  // Share of the spots' surface that lies between cells on the plane, or that other views would show unlike if it were infinitely far
  // (spot_views.h). With less the region is on the plane only if they show its spots there oftener than infinitely far away, or if none
  // looks there. 0: not asked.
  double min_unlike = 0;
  double min_foretold = 0;  // share of what the plane foretells of the spots' directions (spot_views.h) that other views must show
};

// One region's.
class RegionSky {
 public:
  // `spots`: of the region's pixels without an anchor. `views`: null: brightness is not asked. Both outlive this.
  RegionSky(std::span<const Spot> spots, const SpotViews* views, const SkyLimits& limits) : spots_(spots), views_(views), limits_(limits) {}

  using CellsOn = std::function<std::vector<AnchorCell>()>;
  // What the region is if it is not on the plane; kNot: it may be on it. `cells_on` gives the cells on the plane, in whichever view: to
  // find them takes time, and the spots alone may decide.
  Sky Judge(const ImagePlane& plane, const CellsOn& cells_on) const;

 private:
  bool IsUnlikeForetold(const ImagePlane& plane) const;
  Sky LookFar(const ImagePlane& plane, const std::vector<AnchorCell>& on) const;

  std::span<const Spot> spots_;
  const SpotViews* views_;
  SkyLimits limits_;
};

}  // namespace phi
