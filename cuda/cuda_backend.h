// The GPU backend: one phi::Backend per device.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "cuda/device.h"
#include "phi/backend.h"

namespace phi::gpu {

// One backend per GPU of `gpu_indices` (--PatchMatchStereo.gpu_index), at least one; empty or {-1} means all of them. Each has
// passed the self-test; a device that fails is left out with a warning. budget_bytes: of device memory on each GPU; <= 0: what is
// free. num_pixels: of the largest image, for how many images come at once; 0: not known. Throws phi::UsageError for an index that
// does not exist, phi::DeviceError where every device fails, and phi::ResourceError where there is none.
std::vector<std::unique_ptr<Backend>> MakeCudaBackends(const std::vector<int>& gpu_indices,
                                                       std::int64_t budget_bytes = 0, std::int64_t num_pixels = 0);

}  // namespace phi::gpu
