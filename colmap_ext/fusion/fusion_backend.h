// Which device decides fusion's pixels: --PhiFusion.backend. The cloud is the same.
#pragma once

#include <cstdint>
#include <memory>

#include "phi/fusion/fusion_device.h"

namespace colmap_ext {

enum class FusionBackend { kAuto, kCuda, kCpu };

// num_lookups: of pixels in neighbouring maps, for kAuto, which takes a GPU where the processor needs longer than it takes to start one.
// Null: the processor does it. Throws phi::NoDeviceError where kCuda is asked for and there is none.
std::unique_ptr<phi::FusionDevice> MakeFusionDevice(FusionBackend backend, std::int64_t num_lookups);

}  // namespace colmap_ext
