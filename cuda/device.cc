#include "cuda/device.h"

#include <cuda_runtime_api.h>

#include "cuda/error.h"
#include "phi/base/error.h"

namespace phi::gpu {

int NumCudaDevices(std::string* why_none) {
  int count = 0;
  const cudaError_t status = cudaGetDeviceCount(&count);
  if (status == cudaSuccess && count > 0) return count;
  cudaGetLastError();
  if (why_none) {
    *why_none = status == cudaErrorInsufficientDriver
                    ? "no NVIDIA driver is installed, or it is older than this build's CUDA toolkit"
                : status == cudaSuccess || status == cudaErrorNoDevice ? "no CUDA device was found"
                                                                       : cudaGetErrorString(status);
  }
  return 0;
}

DeviceProperties QueryDevice(int index) {
  std::string why_none;
  const int count = NumCudaDevices(&why_none);
  if (count == 0) throw NoDeviceError(why_none + "; --PhiStereo.backend cpu needs none");
  if (index < 0 || index >= count) {
    throw UsageError("--PatchMatchStereo.gpu_index names GPU " + std::to_string(index) +
                     ", but this machine's are 0 to " + std::to_string(count - 1));
  }
  cudaDeviceProp properties;
  Check(cudaGetDeviceProperties(&properties, index), "cudaGetDeviceProperties",
        Task{.stage = "device query"});
  return {index, properties.name, properties.multiProcessorCount};
}

ScopedDevice::ScopedDevice(int index) {
  const Task task{.stage = "device selection"};
  Check(cudaGetDevice(&previous_), "cudaGetDevice", task);
  Check(cudaSetDevice(index), "cudaSetDevice", task);
}

ScopedDevice::~ScopedDevice() { cudaSetDevice(previous_); }

}  // namespace phi::gpu
