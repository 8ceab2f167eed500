// The device memory of each kind of call, worked out before anything is allocated; and how a call is done in parts where
// the whole needs more than the budget. The parts give the bytes of the whole: no part is blind for its surroundings.
//
//   estimation  the state of the pixels stays in host memory, and each half-pass goes over bands of rows, which come with the
//               rows around them that propagation reads
//   sharing     the source maps take turns, then bands of rows, too
//   filter      the source maps take turns; what they say of each pixel is carried on
//   inference   not done in parts
#pragma once

#include <cstdint>

#include "cuda/error.h"
#include "phi/backend.h"

namespace phi::gpu {

struct EstimationPlan {
  int band_rows = 0;                   // a multiple of kTileSide; 0: the whole state is on the device
  std::int64_t num_coarse_pixels = 0;  // room for those that a finer part starts from
  std::int64_t bytes = 0;              // of device memory
};

struct SharingPlan {
  int num_sources_at_once = 0;
  int band_rows = 0;        // a multiple of kTileSide, or the height
  std::int64_t bytes = 0;   // of device memory
};

struct FilterPlan {
  int num_sources_at_once = 0;
  std::int64_t bytes = 0;
};

// Throw phi::DeviceError with the bytes needed and available when even the smallest parts need more than `budget` bytes.
// coarse_start: the estimation goes from coarse to fine (phi/matching/coarse_start.h).
EstimationPlan PlanEstimation(const EstimationInput& input, std::int64_t budget, const Task& task,
                              bool coarse_start = false);
SharingPlan PlanSharing(const SharingInput& input, std::int64_t budget, const Task& task);
FilterPlan PlanFilter(const FilterInput& input, std::int64_t budget, const Task& task);
std::int64_t PlanInference(const InferenceInput& input, std::int64_t budget, const Task& task);

// Bytes of an estimation that keeps the whole state on the device.
std::int64_t EstimationBytes(const EstimationInput& input, bool coarse_start = false);

}  // namespace phi::gpu
