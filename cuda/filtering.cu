#include "cuda/filtering_kernels.h"

namespace phi::gpu {
namespace {

__global__ void AskKernel(const __grid_constant__ FilterLaunch launch, ArrayView2D<FilterState> states) {
  const int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y * blockDim.y + threadIdx.y;
  if (!states.Contains(x, y)) return;
  FilterState state = states(x, y);
  AskSources(launch.reference, launch.turn, x, y, &state);
  states(x, y) = state;
}

__global__ void JudgeKernel(const __grid_constant__ FilterReference reference,
                            ArrayView2D<const FilterState> states, ArrayView2D<FilterVerdict> verdicts) {
  const int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y * blockDim.y + threadIdx.y;
  if (verdicts.Contains(x, y)) verdicts(x, y) = JudgeByViews(reference, x, y, states(x, y));
}

constexpr dim3 kBlock(32, 8);

dim3 GridOf(int width, int height) {
  return {(width + kBlock.x - 1) / kBlock.x, (height + kBlock.y - 1) / kBlock.y};
}

}  // namespace

void LaunchAskSources(const FilterLaunch& launch, ArrayView2D<FilterState> states, cudaStream_t stream,
                      const Task& task) {
  AskKernel<<<GridOf(states.width, states.height), kBlock, 0, stream>>>(launch, states);
  CheckLaunch("AskKernel", task);
}

void LaunchJudge(const FilterReference& reference, ArrayView2D<const FilterState> states,
                 ArrayView2D<FilterVerdict> verdicts, cudaStream_t stream, const Task& task) {
  JudgeKernel<<<GridOf(states.width, states.height), kBlock, 0, stream>>>(reference, states, verdicts);
  CheckLaunch("JudgeKernel", task);
}

}  // namespace phi::gpu
