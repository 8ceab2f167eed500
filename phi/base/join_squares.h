// Joins each pixel of a mask with its neighbours: all of them (and), or any (or).
#pragma once

#include <algorithm>
#include <vector>

#include "phi/base/images.h"

namespace phi {

// One row of a mask, each pixel joined with its neighbours up to `radius` away along both axes: columns first, then rows,
// in loops that become vector instructions. Rows and not whole masks: fresh memory of an image's size costs more than the
// work.
template <class Join>
void JoinSquares(const Mask& mask, int radius, int y, const Join& join, std::uint8_t* joined) {
  const int width = mask.width();
  std::vector<std::uint8_t> columns(&mask(0, y), &mask(0, y) + width);
  for (int v = std::max(y - radius, 0); v <= std::min(y + radius, mask.height() - 1); ++v) {
    const std::uint8_t* row = &mask(0, v);
    for (int x = 0; x < width; ++x) columns[x] = join(columns[x], row[x]);
  }
  std::copy(columns.begin(), columns.end(), joined);
  for (int u = -radius; u <= radius; ++u) {
    const int end = std::min(width, width - u);
    for (int x = std::max(0, -u); x < end; ++x) joined[x] = join(joined[x], columns[x + u]);
  }
}

}  // namespace phi
