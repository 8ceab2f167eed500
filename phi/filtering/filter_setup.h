// What the backends' consistency filters read, from their common input.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/backend.h"
#include "phi/filtering/filter_pixel.h"
#include "phi/options.h"

namespace phi {

ConsistencyThresholds MakeConsistencyThresholds(const FilterOptions& options);

// Views the arrays of `input` on the host.
FilterReference MakeFilterReference(const FilterInput& input, const FilterOptions& options);

// The source views that have a map.
std::vector<SourceMap> SourcesWithMap(const FilterInput& input);

// The pixels of `map` where `keep` is not 0; the rest have no depth. `keep`: as many values as the map has pixels.
PlaneMap KeptPixels(const PlaneMap& map, const std::uint8_t* keep);

}  // namespace phi
