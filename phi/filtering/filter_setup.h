// What the backends' consistency filters read, from their common input.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/backend.h"
#include "phi/filtering/filter_pixel.h"
#include "phi/options.h"

namespace phi {

ConsistencyThresholds MakeConsistencyThresholds(const FilterOptions& options);

// Views the arrays of `input` on the host. Throws UsageError where a judgement is asked of what is no estimate, or by an image of another
// size.
FilterReference MakeFilterReference(const FilterInput& input, const FilterOptions& options);

// The source views that have a map.
std::vector<SourceMap> SourcesWithMap(const FilterInput& input);

// `map` without the dropped pixels, and the others' states. One verdict for each pixel.
MeasurementMap KeptPixels(const MeasurementMap& map, const FilterVerdict* verdicts);

// Of an estimate that was judged: the pixels that have a state.
MeasurementMap JudgedPixels(const PlaneMap& estimate, const PixelState* states);

}  // namespace phi
