// The four texels of each bilinear cell in one 32-bit word, for reads by plain loads beside the texture units; or, where
// memory is short, gathered by the texture units: the same four bytes.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "cuda/error.h"
#include "phi/base/hd.h"

namespace phi::gpu {

// Word (x, y), 0 <= x <= width, 0 <= y <= height, holds the texels (x - 1, y - 1), (x, y - 1), (x - 1, y), (x, y), lowest
// byte first, repeated at the border. So (u, v) in K's coordinates lies in the cell (floor(u + 0.5), floor(v + 0.5)).
struct TexelQuads {
  const std::uint32_t* data = nullptr;  // null: not stored
  int pitch = 0;                        // words
  cudaTextureObject_t gather = 0;       // the texture to gather from where they are not stored
};

PHI_HD int QuadPitch(int width) { return (width + 1 + 31) / 32 * 32; }
inline std::int64_t NumQuads(int width, int height) {
  return static_cast<std::int64_t>(QuadPitch(width)) * (height + 1);
}

// From a texture of gray / 255 with linear filtering.
void LaunchTexelQuads(cudaTextureObject_t texture, int width, int height, std::uint32_t* quads,
                      cudaStream_t stream, const Task& task);

}  // namespace phi::gpu
