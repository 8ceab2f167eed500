// What the pixels of even regions take from their regions' planes, once the holes are filled.
#pragma once

#include "phi/base/rules.h"
#include "phi/geometry/device_camera.h"
#include "phi/inference/region_planes.h"
#include "phi/measurement.h"

namespace phi {

// Filled pixels on a region's plane take its normal: fitted again, the depths beside the plane would bend it (`region_normals`).
//
// Before that, measured pixels off their region's planes, by more than an anchor on them may be, become inferred ones on the nearest of
// them, which other views have still to confirm (`edge_depths`): on a plain wall beside a shelf a window's only contrast is the shelf's
// edge, so that it matches at the shelf's depth, in every view alike. Regions without a plane keep what was measured,
// and a map that `keeps_measured` all of it.
void FinishRegionPixels(const RegionPlanes& planes, const RayModel& rays, bool keeps_measured, const Rules& rules,
                        MeasurementMap* map);

}  // namespace phi
