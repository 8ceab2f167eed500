#include "cuda/filtering_kernels.h"

namespace phi::gpu {
namespace {

__global__ void FilterKernel(const __grid_constant__ FilterLaunch launch, ArrayView2D<std::uint8_t> keep) {
  const int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y * blockDim.y + threadIdx.y;
  if (!keep.Contains(x, y)) return;
  keep(x, y) = FilterPixel(launch.reference, launch.turn, x, y, keep(x, y));
}

}  // namespace

void LaunchFilter(const FilterLaunch& launch, ArrayView2D<std::uint8_t> keep, cudaStream_t stream,
                  const Task& task) {
  const dim3 block(32, 8), grid((keep.width + 31) / 32, (keep.height + 7) / 8);
  FilterKernel<<<grid, block, 0, stream>>>(launch, keep);
  CheckLaunch("FilterKernel", task);
}

}  // namespace phi::gpu
