// Launch of the consistency filter (paper section D). The kernel runs phi/filtering/consistency.h per pixel.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "cuda/error.h"
#include "phi/filtering/consistency.h"

namespace phi::gpu {

struct FilterSource {
  RelativeView view;
  ArrayView2D<const PlaneHypothesis> map;
};

struct FilterLaunch {
  RayModel reference;
  ConsistencyThresholds thresholds;
  int min_num_consistent = 0, min_num_consistent_inferred = 0;
  float max_cost = 0;
  ArrayView2D<const PlaneHypothesis> map;
  ArrayView2D<const float> cost = {};           // no data: not tested
  ArrayView2D<const std::uint8_t> filled = {};  // no data: nothing is filled
  const FilterSource* sources = nullptr;        // on the device
  int num_sources = 0;
  bool is_first = true, is_last = true;  // of the launches that the source views are divided among
};

// keep: after the last launch 1 where the pixel stays, else 0; before it the number of views that confirm the pixel.
void LaunchFilter(const FilterLaunch& launch, ArrayView2D<std::uint8_t> keep, cudaStream_t stream,
                  const Task& task);

}  // namespace phi::gpu
