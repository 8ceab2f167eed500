// What the pixels of even regions take from their regions' planes, once the holes are filled.
#pragma once

#include "phi/backend.h"
#include "phi/base/rules.h"
#include "phi/inference/region_planes.h"
#include "phi/measurement.h"

namespace phi {

// What lies on the sky beside things goes (sky_rims.h).
//
// Filled pixels on a region's plane take its normal: fitted again, the depths beside the plane would bend it (`region_normals`).
//
// Before that, measured pixels off their region's planes, by more than an anchor on them may be, become inferred ones on the nearest of
// them, which other views have still to confirm (`edge_depths`): on a plain wall beside a shelf a window's only contrast is the shelf's
// edge, so that it matches at the shelf's depth, in every view alike. Regions without a plane keep what was measured,
// and a map whose input `keeps_measured` all of it.
void FinishRegionPixels(const RegionPlanes& planes, const InferenceInput& input, const Rules& rules, MeasurementMap* map);

// A correction that no view confirms is none (`edge_depths`): what was measured there is measured again.
//   measured: before inference; inferred: the states after it; min_num_consistent: views that the filter asked to confirm what was
//   inferred, 0: none, and so no correction; filtered: what it kept of that.
void RestoreMeasured(const MeasurementMap& measured, const StateMap& inferred, int min_num_consistent, MeasurementMap* filtered);

}  // namespace phi
