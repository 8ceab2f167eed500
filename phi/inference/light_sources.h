// Windows, lamps and the sky in an image: what is bright and has no shade.
//
// Light makes shade on what it falls on, so that an even wall is brighter here than there; what shines is as bright everywhere. No
// view's parallax tells a pane from a wall, for its frame moves as a wall's border does.
#pragma once

#include <span>
#include <vector>

#include "phi/base/rules.h"
#include "phi/inference/spot.h"
#include "phi/inference/spot_views.h"

namespace phi {

// Which even regions, given by their spots, are sources of light: brighter than half of the image, and with far less shade than its
// other regions have. Shade: how far the brightness of a region's spots varies, over its mean. `all`: the image's spots, to which those
// of the regions belong. Where all regions have as little, as walls in the sun do, none is one. Regions of few spots are not judged, nor
// what may be cut off at white.
std::vector<bool> FindLightSources(std::span<const std::vector<Spot>> regions, const SpotGrid& all, const SpotViews& views,
                                   const Rules& rules);

}  // namespace phi
