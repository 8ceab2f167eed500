// Sharing of hypotheses on the CPU: see phi/matching/share_pixel.h.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {

// Of each source the nearest plane that falls on the pixel, as it meets the ray through the pixel's centre; of these the one that
// more than half of the sources with one carry, else one that is left of a vote in their order (Boyer and Moore's). Depth 0,
// nothing is offered: where a source's plane is the pixel's own, where the pixel has none (it is masked), and where no source's
// falls on it. Planes beyond the estimation's range of depths are not offered. `own`: of the reference, of its camera's size.
// Sources are loaded one after the other.
PlaneMap OfferedPlanes(const EstimationParameters& parameters, const ViewMap& own,
                       const std::vector<SourceMap>& sources);

PlaneMap ShareOnCpu(const SharingInput& input, const StereoOptions& options);

}  // namespace phi
