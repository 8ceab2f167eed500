// Evenly coloured regions of an image: connected pixels (four neighbours) whose smoothed brightness changes slowly, in
// all four directions and a margin around. Whatever is next to a step of brightness connects nothing, so that
// two walls do not become one region where the edge between them fades for a few pixels; where it fades for more, the region is parted
// at the neck (region_parts.h). Then each region goes on by the few pixels that a sharp edge spoils, so that two of them meet at it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "phi/base/images.h"
#include "phi/base/rules.h"
#include "phi/inference/continued_regions.h"

namespace phi {

struct ImageRegions {
  // 0 to num_regions - 1, in the order of the regions' first pixels inside; -1: in none
  Array2D<std::int32_t> region;
  std::int32_t num_regions = 0;
  RegionLists continued = {};  // empty: not asked
  Mask creases = {};           // of FindCreases; empty: not asked

  std::size_t bytes() const { return region.bytes() + creases.bytes(); }  // the lists take next to nothing
};

// function(region, begin, end) for the runs of pixels of row y that share a region; also of those that are in none.
template <typename Function>
void ForRunsOfRow(const ImageRegions& regions, int y, const Function& function) {
  const std::int32_t* row = &regions.region(0, y);
  const int width = regions.region.width();
  for (int x = 0, end = 0; x < width; x = end) {
    const std::int32_t region = row[x];
    while (end < width && row[end] == region) ++end;
    function(region, x, end);
  }
}

// The same for any number of threads. None without the rule of their planes.
ImageRegions FindRegions(const GrayImage& image, const Rules& rules = {});

}  // namespace phi
