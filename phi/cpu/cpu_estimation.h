// The estimation of one reference image on the CPU: TBB over rows, one colour of the checkerboard at a time.
#pragma once

#include "phi/backend.h"

namespace phi {

EstimationResult EstimateOnCpu(const EstimationInput& input, const StereoOptions& options);

}  // namespace phi
