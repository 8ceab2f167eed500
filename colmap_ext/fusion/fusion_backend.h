// Which device decides fusion's pixels: --PhiFusion.backend. The cloud is the same.
#pragma once

#include <cstdint>
#include <memory>

#include "colmap_ext/pipeline/backend_choice.h"
#include "phi/fusion/fusion_device.h"

namespace colmap_ext {

enum class FusionBackend { kAuto, kCuda, kCpu };

// The one that fusion may take.
struct FusionGpu {
  int index = 0;                  // CUDA's number
  std::int64_t memory_bytes = 0;  // 0: most of what is free
};

// Of those that stereo may use the first, with the memory that it may use.
FusionGpu FirstGpu(const BackendOptions& stereo);

// num_lookups: of pixels in neighbouring maps, for kAuto, which takes a GPU where the processor needs longer than it takes to start one.
// Null: the processor does it. Throws phi::NoDeviceError where kCuda is asked for and there is none.
std::unique_ptr<phi::FusionDevice> MakeFusionDevice(FusionBackend backend, const FusionGpu& gpu, std::int64_t num_lookups);

}  // namespace colmap_ext
