// Bilinear grey levels from a texture of gray / 255, as phi's templates sample images.
#pragma once

#include <cuda_runtime_api.h>

namespace phi::gpu {

// (u, v) in K's coordinates: pixel centres at half-integers, as the hardware has them.
struct TextureSampler {
  cudaTextureObject_t texture = 0;

#if defined(__CUDACC__)
  __device__ __forceinline__ float operator()(float u, float v) const {
    return 255.0f * tex2D<float>(texture, u, v);
  }
#endif
};

}  // namespace phi::gpu
