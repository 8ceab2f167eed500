// Regions that may be one surface. What stands before a surface parts it: a tree leaves a wall on either side of its trunk, and the
// depths along the trunk are the trunk's, so that only both parts together tell where the wall is.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/base/array2d.h"

namespace phi {

// By region: other regions, ascending.
using RegionLists = std::vector<std::vector<std::int32_t>>;

// Rows and columns of the image, a cell's side apart, leave a region and meet another next, right behind it or beyond something else.
// Those are listed, each for the other, that are as bright there on most of them, and on three at least.
//   region: 0 to num_regions - 1, -1: none; brightness: of the same pixels, smoothed; max_change: in its unit;
//   reach: so many pixels within a region's end an edge changes nothing any more.
RegionLists FindContinuedRegions(const Array2D<std::int32_t>& region, std::int32_t num_regions, const Array2D<std::uint16_t>& brightness,
                                 int max_change, int reach);

}  // namespace phi
