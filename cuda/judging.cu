// Judging on the device gives the host's states, but for the last bit of log2f: compiled without fused multiply-adds, as the host's code is.
#include "cuda/judging_kernels.h"
#include "cuda/pixel_grid.cuh"
#include "phi/filtering/judge_pixel.h"

namespace phi::gpu {
namespace {

constexpr dim3 kBlock(32, 8);

// SumBoxes3x3. The texture gives back the whole grey levels at the middles of its pixels, and at the border the nearest one's.
__global__ void SumKernel(TextureSampler photo, ArrayView2D<std::uint16_t> sums) {
  const int x = ThreadX(), y = ThreadY();
  if (!sums.Contains(x, y)) return;
  float sum = 0;
  for (int v = -1; v <= 1; ++v) {
    for (int u = -1; u <= 1; ++u) sum += rintf(photo(x + u + 0.5f, y + v + 0.5f));
  }
  sums(x, y) = static_cast<std::uint16_t>(sum);
}

__global__ void PlainKernel(const __grid_constant__ JudgementReference judgement, ArrayView2D<std::uint8_t> is_plain) {
  const int x = ThreadX(), y = ThreadY();
  if (is_plain.Contains(x, y)) is_plain(x, y) = IsPlain(judgement, x, y);
}

__global__ void MeasureKernel(const __grid_constant__ FilterReference filter, const __grid_constant__ JudgementReference judgement,
                              ArrayView2D<const Testimonies> testimonies, ArrayView2D<PixelState> states) {
  const int x = ThreadX(), y = ThreadY();
  if (!states.Contains(x, y)) return;
  const Testimonies of_pixel = testimonies(x, y);
  states(x, y) = JudgePixel(judgement, x, y, of_pixel, JudgeByViews(filter, x, y, of_pixel));
}

}  // namespace

void LaunchOwnTexture(const JudgementReference& judgement, TextureSampler photo, const OwnTextureArrays& arrays, cudaStream_t stream,
                      const Task& task) {
  const dim3 grid = PixelGrid(arrays.sums.width, arrays.sums.height, kBlock);
  SumKernel<<<grid, kBlock, 0, stream>>>(photo, arrays.sums);
  CheckLaunch("SumKernel", task);
  if (judgement.is_plain.data == nullptr) return;
  PlainKernel<<<grid, kBlock, 0, stream>>>(judgement, arrays.is_plain);
  CheckLaunch("PlainKernel", task);
}

void LaunchMeasure(const FilterReference& filter, const JudgementReference& judgement, ArrayView2D<const Testimonies> testimonies,
                   ArrayView2D<PixelState> states, cudaStream_t stream, const Task& task) {
  MeasureKernel<<<PixelGrid(states.width, states.height, kBlock), kBlock, 0, stream>>>(filter, judgement, testimonies, states);
  CheckLaunch("MeasureKernel", task);
}

}  // namespace phi::gpu
