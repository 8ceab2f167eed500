// The consistency filter of one reference map on the CPU: TBB over rows, one source map after the other.
#pragma once

#include "phi/backend.h"

namespace phi {

MeasurementMap FilterOnCpu(const FilterInput& input, const FilterOptions& options);

}  // namespace phi
