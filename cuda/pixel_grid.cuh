// A thread a pixel, by columns and rows.
#pragma once

#include <cuda_runtime.h>

namespace phi::gpu {

__device__ __forceinline__ int ThreadX() { return blockIdx.x * blockDim.x + threadIdx.x; }
__device__ __forceinline__ int ThreadY() { return blockIdx.y * blockDim.y + threadIdx.y; }

// As many blocks as cover so many pixels.
inline dim3 PixelGrid(int width, int height, dim3 block) {
  return {(width + block.x - 1) / block.x, (height + block.y - 1) / block.y};
}

}  // namespace phi::gpu
