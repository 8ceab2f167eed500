// Thresholds of the consistency test in the form that a pixel's code uses.
#pragma once

#include "phi/filtering/consistency.h"
#include "phi/options.h"

namespace phi {

ConsistencyThresholds MakeConsistencyThresholds(const FilterOptions& options);

}  // namespace phi
