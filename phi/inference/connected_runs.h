// Connected pixels of a mask (four neighbours) as runs along rows: of plain walls a few thousand in place of millions of pixels.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/base/images.h"

namespace phi {

// Pixels begin to end - 1 of an image, row after row; all in one row.
struct PixelRun {
  std::int32_t begin, end;
  std::int32_t label;  // of the connected pixels that it belongs to
};

struct ConnectedRuns {
  std::vector<PixelRun> runs;       // row by row, from left to right
  std::vector<std::int64_t> sizes;  // pixels of each label; labels go by the first pixel
};

// `mask`: 0 or 255. The same for any number of threads.
ConnectedRuns FindConnectedRuns(const Mask& mask);

inline constexpr std::int32_t kInNoRun = -1;

// The label of each pixel of an image; kInNoRun: of no run.
Array2D<std::int32_t> LabelImage(const ConnectedRuns& connected, int width, int height);

}  // namespace phi
