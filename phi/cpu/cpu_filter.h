// The consistency filter of one reference map on the CPU: TBB over rows, one source map after the other.
#pragma once

#include "phi/backend.h"

namespace phi {

// said: null, or what becomes what the views say of each pixel.
MeasurementMap FilterOnCpu(const FilterInput& input, const FilterOptions& options, Array2D<Testimonies>* said = nullptr);

}  // namespace phi
