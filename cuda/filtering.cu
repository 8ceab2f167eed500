#include "cuda/filtering_kernels.h"
#include "cuda/pixel_grid.cuh"

namespace phi::gpu {
namespace {

__global__ void AskKernel(const __grid_constant__ FilterLaunch launch, ArrayView2D<Testimonies> testimonies) {
  const int x = ThreadX(), y = ThreadY();
  if (!testimonies.Contains(x, y)) return;
  Testimonies of_pixel = testimonies(x, y);
  AskSources(launch.reference, launch.turn, x, y, &of_pixel);
  testimonies(x, y) = of_pixel;
}

__global__ void JudgeKernel(const __grid_constant__ FilterReference reference,
                            ArrayView2D<const Testimonies> testimonies, ArrayView2D<FilterVerdict> verdicts) {
  const int x = ThreadX(), y = ThreadY();
  if (verdicts.Contains(x, y)) verdicts(x, y) = JudgeByViews(reference, x, y, testimonies(x, y));
}

constexpr dim3 kBlock(32, 8);

}  // namespace

void LaunchAskSources(const FilterLaunch& launch, ArrayView2D<Testimonies> testimonies, cudaStream_t stream,
                      const Task& task) {
  AskKernel<<<PixelGrid(testimonies.width, testimonies.height, kBlock), kBlock, 0, stream>>>(launch, testimonies);
  CheckLaunch("AskKernel", task);
}

void LaunchJudge(const FilterReference& reference, ArrayView2D<const Testimonies> testimonies,
                 ArrayView2D<FilterVerdict> verdicts, cudaStream_t stream, const Task& task) {
  JudgeKernel<<<PixelGrid(testimonies.width, testimonies.height, kBlock), kBlock, 0, stream>>>(reference, testimonies, verdicts);
  CheckLaunch("JudgeKernel", task);
}

}  // namespace phi::gpu
