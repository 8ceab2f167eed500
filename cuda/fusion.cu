#include "cuda/fusion_kernels.h"

#include <cub/device/device_select.cuh>

namespace phi::gpu {
namespace {

__global__ void DecideKernel(const __grid_constant__ FusionLaunch launch, FusionVerdicts verdicts) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= launch.num_pixels) return;
  const std::uint32_t number = launch.pixels[i];
  const int x = static_cast<int>(number) % launch.map.width, y = static_cast<int>(number) / launch.map.width;
  const ReferencePixel reference = {launch.map(x, y), launch.rays.Ray(x + 0.5f, y + 0.5f), launch.rays.fx};
  const PixelSupport support = DecidePixel(launch.neighbors, launch.num_neighbors, launch.gates, reference);
  const bool is_inferred = (reference.pixel.flags & FusionPixel::kInferred) != 0;
  const PixelOutcome outcome = JudgePixel(launch.gates, support, is_inferred);
  verdicts.outcomes[i] = outcome;
  verdicts.is_fused[i] = outcome == PixelOutcome::kFused;
  if (outcome != PixelOutcome::kFused) return;
  verdicts.fused[i] = {number, support.point, DoubtsOf(support), support.views};
  launch.map(x, y).flags |= FusionPixel::kEmitted;
}

}  // namespace

void LaunchDecide(const FusionLaunch& launch, const FusionVerdicts& verdicts, cudaStream_t stream, const Task& task) {
  constexpr int kThreads = 128;
  DecideKernel<<<(launch.num_pixels + kThreads - 1) / kThreads, kThreads, 0, stream>>>(launch, verdicts);
  CheckLaunch("DecideKernel", task);
}

void LaunchGather(const FusionVerdicts& verdicts, int num_pixels, const GatheredPixels& gathered, DeviceBuffer<std::uint8_t>* scratch,
                  cudaStream_t stream, const Task& task) {
  std::size_t num_bytes = 0;
  const auto select = [&](void* memory) {
    Check(cub::DeviceSelect::Flagged(memory, num_bytes, verdicts.fused, verdicts.is_fused, gathered.pixels, gathered.count, num_pixels,
                                     stream),
          "cub::DeviceSelect::Flagged", task);
  };
  select(nullptr);  // asks for the bytes
  scratch->Reserve(static_cast<std::int64_t>(num_bytes), task);
  select(scratch->data());
}

}  // namespace phi::gpu
