// Work of a block's pixels, dealt out to the block's threads anew: none waits while others have much to do, and the threads of a
// warp do the same.
#pragma once

#include <cstdint>

#include "cuda/checkerboard.cuh"
#include "cuda/matching_context.cuh"

namespace phi::gpu {

// A thread of the block, 7 bits, and the number k of what is to be done for it above these.
using WorkItem = std::uint16_t;
static_assert(kThreads == 1 << 7);
__device__ __forceinline__ int ThreadOf(WorkItem item) { return item & (kThreads - 1); }
__device__ __forceinline__ int NumberOf(WorkItem item) { return item / kThreads; }

// Lists an item for each of the thread's bits k of `wanted`, k below kMost: by k, then by thread. Returns how many there are. All
// threads of the block must call it; what they wrote to shared memory before, all may read after it. `items` is shared memory.
template <int kMost>
__device__ __forceinline__ int ListWork(unsigned wanted, WorkItem* items) {
  constexpr int kWarps = kThreads / 32, kNumCounts = kMost * kWarps;
  constexpr unsigned kWarp = 0xffffffffu;
  static_assert(kNumCounts <= 32);
  __shared__ int starts[kNumCounts + 1];
  const int lane = threadIdx.x & 31, warp = threadIdx.x >> 5;
  unsigned of_warp[kMost];
#pragma unroll
  for (int k = 0; k < kMost; ++k) {
    of_warp[k] = __ballot_sync(kWarp, wanted >> k & 1u);
    if (lane == 0) starts[k * kWarps + warp] = __popc(of_warp[k]);
  }
  __syncthreads();
  if (warp == 0) {
    const int count = lane < kNumCounts ? starts[lane] : 0;
    int sum = count;
    for (int distance = 1; distance < 32; distance *= 2) {
      const int before = __shfl_up_sync(kWarp, sum, distance);
      if (lane >= distance) sum += before;
    }
    if (lane < kNumCounts) starts[lane] = sum - count;
    if (lane == 31) starts[kNumCounts] = sum;
  }
  __syncthreads();
#pragma unroll
  for (int k = 0; k < kMost; ++k) {
    if ((wanted >> k & 1u) == 0) continue;
    const int before = __popc(of_warp[k] & ((1u << lane) - 1));
    items[starts[k * kWarps + warp] + before] = static_cast<WorkItem>(threadIdx.x | k * kThreads);
  }
  __syncthreads();
  return starts[kNumCounts];
}

// The pixels of a block's tile, those of one pyramid level together: a warp whose threads differ in it goes over its pixels once
// for each level. All kernels of a half-pass find the same order.
class TilePixels {
 public:
  // All threads of the block must call it. `order`: kThreads items of shared memory.
  __device__ __forceinline__ TilePixels(const EstimationLaunch& launch, int colour, WorkItem* order)
      : order_(order), colour_(colour), first_row_(launch.first_row) {
    constexpr unsigned kLevelBits = (1u << kMaxPyramidLevels) - 1;
    const PixelPosition pixel = CheckerboardPixel(threadIdx.x, colour, first_row_);
    const bool is_inside = launch.state.plane.Contains(pixel.x, pixel.y);
    num_ = ListWork<kMaxPyramidLevels>(is_inside ? launch.window_scales(pixel.x, pixel.y) & kLevelBits : 0, order);
  }

  // Whether the thread has one.
  __device__ __forceinline__ bool IsMine() const { return static_cast<int>(threadIdx.x) < num_; }
  __device__ __forceinline__ PixelPosition Of(int thread) const {
    return CheckerboardPixel(ThreadOf(order_[thread]), colour_, first_row_);
  }
  __device__ __forceinline__ PixelPosition Mine() const { return Of(threadIdx.x); }

 private:
  const WorkItem* order_;
  const int colour_, first_row_;
  int num_;
};

}  // namespace phi::gpu
