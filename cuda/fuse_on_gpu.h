// Fusion's decisions on a GPU.
#pragma once

#include <cstdint>
#include <memory>

#include "phi/fusion/fusion_device.h"

namespace phi::gpu {

// budget_bytes: for maps; <= 0: three quarters of what is free. Those that were not used for longest make room for others. Throws
// phi::DeviceError where there is no such GPU, or it does not answer.
std::unique_ptr<FusionDevice> MakeCudaFusion(int gpu_index, std::int64_t budget_bytes = 0);

}  // namespace phi::gpu
