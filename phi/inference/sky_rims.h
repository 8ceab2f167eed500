// What matching found beyond the edge of a roof, a branch or a window's frame: there a window's only contrast is the edge, so that
// the sky beside it matches at the edge's depth, in every view alike.
#pragma once

#include "phi/base/images.h"
#include "phi/base/rules.h"
#include "phi/inference/region_planes.h"
#include "phi/measurement.h"

namespace phi {

// In regions that are the sky, or shine, pixels lose their depth if the region shows itself as bright a few pixels away, where it has
// no depth. What is brighter or darker is the thing before it.
void DropSkyRims(const RegionPlanes& planes, const GrayImage& image, const Rules& rules, MeasurementMap* map);

}  // namespace phi
