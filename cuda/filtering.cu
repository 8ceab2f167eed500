#include "cuda/filtering_kernels.h"

namespace phi::gpu {
namespace {

// Source views that confirm the pixel, up to as many as it needs; -1: it goes whatever they say.
__device__ int NumConsistent(const FilterLaunch& f, int x, int y, int required, std::uint8_t inferred,
                             int before) {
  const PlaneHypothesis h = f.map(x, y);
  if (!(h.depth > 0)) return -1;
  if (f.cost.data != nullptr && inferred == 0 && f.cost(x, y) > f.max_cost) return -1;
  int num_consistent = before;
  for (int j = 0; j < f.num_sources && num_consistent < required; ++j) {
    const FilterSource& source = f.sources[j];
    num_consistent += IsConsistent(f.reference, source.view, x + 0.5f, y + 0.5f, h, source.map, f.thresholds);
  }
  return num_consistent;
}

__global__ void FilterKernel(const __grid_constant__ FilterLaunch launch, ArrayView2D<std::uint8_t> keep) {
  const int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y * blockDim.y + threadIdx.y;
  if (!keep.Contains(x, y)) return;
  const std::uint8_t inferred = launch.filled.data != nullptr ? launch.filled(x, y) : 0;
  const int required = RequiredViews(inferred, launch.min_num_consistent, launch.min_num_consistent_inferred);
  const int count = NumConsistent(launch, x, y, required, inferred, launch.is_first ? 0 : keep(x, y));
  keep(x, y) = launch.is_last ? (count >= required ? 1 : 0) : (count > 0 ? count : 0);
}

}  // namespace

void LaunchFilter(const FilterLaunch& launch, ArrayView2D<std::uint8_t> keep, cudaStream_t stream,
                  const Task& task) {
  const dim3 block(32, 8), grid((keep.width + 31) / 32, (keep.height + 7) / 8);
  FilterKernel<<<grid, block, 0, stream>>>(launch, keep);
  CheckLaunch("FilterKernel", task);
}

}  // namespace phi::gpu
