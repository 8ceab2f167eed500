// Launches of fusion's support rule. The kernel runs phi/fusion/support_pixel.h per pixel.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "cuda/buffer.h"
#include "phi/fusion/support_pixel.h"

namespace phi::gpu {

// All on the device.
struct FusionLaunch {
  ArrayView2D<FusionPixel> map;  // of the reference: receives the emitted flags
  RayModel rays;
  const FusionNeighbor* neighbors = nullptr;
  int num_neighbors = 0;
  FusionGates gates;
  const std::uint32_t* pixels = nullptr;  // their numbers in the map
  int num_pixels = 0;
};

struct FusionVerdicts {
  PixelOutcome* outcomes = nullptr;
  std::uint8_t* is_fused = nullptr;
  FusedPixel* fused = nullptr;  // meaningful where is_fused
};

struct GatheredPixels {
  FusedPixel* pixels = nullptr;
  std::int32_t* count = nullptr;
};

// One verdict a pixel of the launch.
void LaunchDecide(const FusionLaunch& launch, const FusionVerdicts& verdicts, cudaStream_t stream, const Task& task);

// The fused ones in their order. `scratch`: memory that grows as needed.
void LaunchGather(const FusionVerdicts& verdicts, int num_pixels, const GatheredPixels& gathered, DeviceBuffer<std::uint8_t>* scratch,
                  cudaStream_t stream, const Task& task);

}  // namespace phi::gpu
