// Which device decides fusion's pixels: --PhiFusion.backend. The cloud is the same.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "colmap_ext/pipeline/backend_choice.h"
#include "phi/fusion/fusion_device.h"

namespace colmap_ext {

enum class FusionBackend { kAuto, kCuda, kCpu };

// Those of which fusion may take one: the first that works.
struct FusionGpus {
  std::vector<int> indices = {};  // CUDA's numbers; none: all
  std::int64_t memory_bytes = 0;  // 0: most of what is free
};

// Those that stereo may use, with the memory that it may use.
FusionGpus GpusOf(const BackendOptions& stereo);

// num_lookups: of pixels in neighbouring maps, for kAuto, which takes a GPU where the processor needs longer than it takes to start one.
// Null: the processor does it. Throws phi::NoDeviceError where kCuda is asked for and there is none,
// phi::DeviceError where none works.
std::unique_ptr<phi::FusionDevice> MakeFusionDevice(FusionBackend backend, const FusionGpus& gpus, std::int64_t num_lookups);

}  // namespace colmap_ext
