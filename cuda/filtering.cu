#include "cuda/filtering_kernels.h"

namespace phi::gpu {
namespace {

__device__ bool Keeps(const FilterLaunch& f, int x, int y) {
  const PlaneHypothesis h = f.map(x, y);
  if (!(h.depth > 0)) return false;
  const std::uint8_t inferred = f.filled.data != nullptr ? f.filled(x, y) : 0;
  if (f.cost.data != nullptr && inferred == 0 && f.cost(x, y) > f.max_cost) return false;
  const int required = RequiredViews(inferred, f.min_num_consistent, f.min_num_consistent_inferred);
  int num_consistent = 0;
  for (int j = 0; j < f.num_sources && num_consistent < required; ++j) {
    const FilterSource& source = f.sources[j];
    num_consistent += IsConsistent(f.reference, source.view, x + 0.5f, y + 0.5f, h, source.map, f.thresholds);
  }
  return num_consistent >= required;
}

__global__ void FilterKernel(const __grid_constant__ FilterLaunch launch, ArrayView2D<std::uint8_t> keep) {
  const int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y * blockDim.y + threadIdx.y;
  if (keep.Contains(x, y)) keep(x, y) = Keeps(launch, x, y) ? 1 : 0;
}

}  // namespace

void LaunchFilter(const FilterLaunch& launch, ArrayView2D<std::uint8_t> keep, cudaStream_t stream,
                  const Task& task) {
  const dim3 block(32, 8), grid((keep.width + 31) / 32, (keep.height + 7) / 8);
  FilterKernel<<<grid, block, 0, stream>>>(launch, keep);
  CheckLaunch("FilterKernel", task);
}

}  // namespace phi::gpu
