#include "cuda/texel_quads.h"

namespace phi::gpu {
namespace {

__global__ void TexelQuadsKernel(cudaTextureObject_t texture, int width, int height, int pitch,
                                 std::uint32_t* quads) {
  const int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y * blockDim.y + threadIdx.y;
  if (x > width || y > height) return;
  // At a texel's centre the filter returns the texel itself; the address mode repeats the border.
  const auto texel = [&](int column, int row) {
    return static_cast<std::uint32_t>(rintf(255.0f * tex2D<float>(texture, column + 0.5f, row + 0.5f)));
  };
  quads[static_cast<std::int64_t>(y) * pitch + x] =
      texel(x - 1, y - 1) | texel(x, y - 1) << 8 | texel(x - 1, y) << 16 | texel(x, y) << 24;
}

}  // namespace

void LaunchTexelQuads(cudaTextureObject_t texture, int width, int height, std::uint32_t* quads,
                      cudaStream_t stream, const Task& task) {
  const dim3 block(32, 8), grid((width + 32) / 32, (height + 8) / 8);
  TexelQuadsKernel<<<grid, block, 0, stream>>>(texture, width, height, QuadPitch(width), quads);
  CheckLaunch("TexelQuadsKernel", task);
}

}  // namespace phi::gpu
