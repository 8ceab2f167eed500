// Finds the planes of an image's even regions. Each gets up to two in inverse depth by RANSAC over its measured pixels and those of other
// views that land in it, refined by least squares, or takes the scene's where its anchors like them better. Draws are keyed by image,
// region and pixel: the same planes for any number of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "phi/base/array2d.h"
#include "phi/base/rules.h"
#include "phi/inference/anchor_cells.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/plane_choice.h"
#include "phi/inference/plane_evidence.h"
#include "phi/inference/region_plane.h"
#include "phi/inference/region_sky.h"

namespace phi {

struct FittedRegion : ChosenPlanes {
  std::vector<AnchorCell> cells = {};  // of its own anchors
  std::vector<std::int32_t> continued = {};  // those of `regions` that continue it, where it asks any
  bool is_open = false;     // too little of it carries anchors to say that it is not the sky
  bool is_settled = false;  // its shade tells its surface: it does not choose again, no more than the sky does
};

struct FittedRegions {
  std::vector<FittedRegion> regions;  // those that have enough anchors
  std::vector<std::int32_t> index;    // of each region of the image; -1: it has too few
};

// anchors: inverse depth of the image's own, 0: none.
FittedRegions FitRegions(const ImageRegions& regions, ArrayView2D<const float> anchors, std::uint32_t image_id,
                         const PlaneEvidence& evidence, const Rules& rules);

// What the regions of `first`, which FitRegions returned, make of it when they know what the source views' regions chose
// (PlaneEvidence::sources).
FittedRegions FitAgain(const ImageRegions& regions, ArrayView2D<const float> anchors, FittedRegions first,
                       const PlaneEvidence& evidence, const Rules& rules);

}  // namespace phi
