// Evenly coloured regions of an image: connected pixels (four neighbours) whose smoothed brightness changes slowly.
#pragma once

#include <cstdint>

#include "phi/backend.h"

namespace phi {

struct ImageRegions {
  Array2D<std::int32_t> region;  // 0 to num_regions - 1, in the order of the regions' first pixels
  std::int32_t num_regions = 0;
};

// The same for any number of threads.
ImageRegions FindRegions(const GrayImage& image);

}  // namespace phi
