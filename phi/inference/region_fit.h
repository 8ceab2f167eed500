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
#include "phi/inference/plane_evidence.h"
#include "phi/inference/region_plane.h"
#include "phi/inference/region_sky.h"

namespace phi {

struct FittedRegion {
  PlanesOfRegion planes{};
  Sky sky = Sky::kNot;      // why it has no plane
  bool is_mirror = false;   // the first plane: what lies behind it is its reflection
  std::vector<AnchorCell> cells = {};  // of its own anchors
  std::vector<std::int32_t> continued = {};  // those of `regions` that continue it, where it asks any
};

struct FittedRegions {
  std::vector<FittedRegion> regions;  // those that have enough anchors
  std::vector<std::int32_t> index;    // of each region of the image; -1: it has too few
};

// anchors: inverse depth of the image's own, 0: none.
FittedRegions FitRegions(const ImageRegions& regions, ArrayView2D<const float> anchors, std::uint32_t image_id,
                         const PlaneEvidence& evidence, const Rules& rules);

}  // namespace phi
