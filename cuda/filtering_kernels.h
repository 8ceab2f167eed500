// Launch of the consistency filter (paper section D). The kernel runs phi/filtering/filter_pixel.h per pixel.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "cuda/error.h"
#include "phi/filtering/filter_pixel.h"

namespace phi::gpu {

// All on the device.
struct FilterLaunch {
  FilterReference reference;
  FilterTurn turn;
};

// keep: per pixel what FilterPixel returned in the turn before (0 in the first), and then what it returns in this one.
void LaunchFilter(const FilterLaunch& launch, ArrayView2D<std::uint8_t> keep, cudaStream_t stream,
                  const Task& task);

}  // namespace phi::gpu
