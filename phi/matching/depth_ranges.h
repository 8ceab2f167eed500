// Ranges of depth around each pixel, from the sparse points near it (phi/nearest_point_ranges.h).
#pragma once

#include "phi/base/array2d.h"
#include "phi/base/hd.h"

namespace phi {

// Depths in world units; both 0: unknown.
struct DepthRange {
  float min = 0, max = 0;
};

// One range for each cell of so many pixels on a side, exact at the cell's centre.
inline constexpr int kDepthRangeCell = 4;

struct DepthRanges {
  ArrayView2D<const DepthRange> cells;
  int cell = kDepthRangeCell;  // pixels on a side; more where the ranges were found in a reduced image

  PHI_HD DepthRange At(int x, int y) const { return cells(x / cell, y / cell); }
};

}  // namespace phi
