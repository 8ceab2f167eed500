// Every CUDA call is checked. A failure names the stage, the image, its size and the remedy.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "phi/base/device_error.h"

namespace phi::gpu {

// What a call works on, for error messages. Lives as long as the work on one image.
struct Task {
  const char* stage = "set-up";
  std::string image = {};  // COLMAP's name; empty where no image is concerned
  int width = 0, height = 0;

  Message Describe() const;  // "stage 'estimation' of image 'a/b.jpg' (3072x2048)"
};

// The device's memory does not suffice: freeing cached copies may help.
struct OutOfDeviceMemory : DeviceError {
  using DeviceError::DeviceError;
};

// Throws phi::DeviceError, OutOfDeviceMemory where that is the reason. `call` is the CUDA function or kernel that failed.
[[noreturn]] void ThrowCudaError(cudaError_t status, const char* call, const Task& task);

inline void Check(cudaError_t status, const char* call, const Task& task) {
  if (status != cudaSuccess) ThrowCudaError(status, call, task);
}

// After each kernel launch: a bad configuration or a missing kernel image is reported here, a fault at the next sync.
inline void CheckLaunch(const char* kernel, const Task& task) { Check(cudaGetLastError(), kernel, task); }

// A call needs more than the budget (--PhiStereo.device_memory) even in its smallest parts. Throws phi::TooLargeForDevice.
[[noreturn]] void ThrowTooLittleMemory(std::int64_t needed, std::int64_t budget, const Task& task);

// As Check, for allocations: an out-of-memory error says how many bytes were
// needed and how many are free (OutOfDeviceMemory).
void CheckAllocation(cudaError_t status, const char* call, std::size_t bytes, const Task& task);

}  // namespace phi::gpu
