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

// Asks the turn's sources about every pixel. Before the first turn all bytes of `testimonies` are 0.
void LaunchAskSources(const FilterLaunch& launch, ArrayView2D<Testimonies> testimonies, cudaStream_t stream,
                      const Task& task);

// After the last turn.
void LaunchJudge(const FilterReference& reference, ArrayView2D<const Testimonies> testimonies,
                 ArrayView2D<FilterVerdict> verdicts, cudaStream_t stream, const Task& task);

}  // namespace phi::gpu
