// Pixels are measured where their neighbours agree with them.
//
// Where two surfaces meet, in a crease or beside an edge, a window that sees both can match between them, in every view
// alike, so that the views confirm it. Its neighbours, each with a window of its own, do not. And what stands alone on a plain
// wall, a speck or the rim of something before it, is often wrong.
#pragma once

#include "phi/base/array2d.h"
#include "phi/base/rules.h"
#include "phi/geometry/device_camera.h"
#include "phi/measurement.h"

namespace phi {

// Contradicted: at least half of the 24 neighbours have depth, and fewer than this share of those agree (neighbor_planes.h). A
// bar three pixels wide stays (14 of 24 agree at its rim), one of two goes (9).
inline constexpr int kMinNeighborsAsked = 12, kMinPercentAgreeing = 40;
// Alone: fewer than these agree, a third of all. The corner pixel of an image has as many.
inline constexpr int kMinNeighborsAgreeing = 8;

// Drops what is contradicted or alone, judged by the map as it was. `rays`: of the map's view; `deviations`: what matching can tell
// of its depths (DepthPrecision::RelativeDeviations), at least where it has any.
void DropLonelyPixels(const RayModel& rays, const Array2D<float>& deviations, MeasurementMap* map,
                      const Rules& rules = {});

}  // namespace phi
