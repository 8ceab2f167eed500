// Threads to pixels of one colour of the checkerboard, packed so that every thread of a warp has a pixel.
#pragma once

#include <cuda_runtime.h>

#include "cuda/estimation_kernels.h"

namespace phi::gpu {

struct PixelPosition {
  int x, y;
};

// A warp covers one colour of 8 x 8 pixels and a texture unit's group of four threads one of 4 x 2, so that fetches
// fall near each other.
// thread: of the block; first_row: of the rows that the grid covers, a multiple of kTileSide.
__device__ __forceinline__ PixelPosition CheckerboardPixel(int thread, int colour, int first_row) {
  const int lane = thread & 31, warp = thread >> 5;
  const int packed_column = (lane & 1) | ((lane >> 1) & 2);
  const int row = ((lane >> 1) & 1) | ((lane >> 2) & 6);
  const int y = first_row + blockIdx.y * kTileSide + (warp >> 1) * 8 + row;
  const int x = blockIdx.x * kTileSide + (warp & 1) * 8 + 2 * packed_column + ((row + colour) & 1);
  return {x, y};
}

inline dim3 CheckerboardGrid(int width, int num_rows) {
  return dim3((width + kTileSide - 1) / kTileSide, (num_rows + kTileSide - 1) / kTileSide);
}

}  // namespace phi::gpu
