#include "cuda/device.h"

#include <cuda_runtime_api.h>

#include <cstddef>
#include <numeric>
#include <thread>
#include <utility>

#include "cuda/error.h"
#include "phi/base/error.h"

namespace phi::gpu {
namespace {

// A function of the driver: programs start where there is none, so it is not linked.
template <typename Function>
Function FromDriver(const char* name) {
  void* function = nullptr;
#if CUDART_VERSION >= 12050
  constexpr unsigned kSince = 4000;  // the version of CUDA that both functions come from
  const cudaError_t status = cudaGetDriverEntryPointByVersion(name, &function, kSince, cudaEnableDefault);
#else
  const cudaError_t status = cudaGetDriverEntryPoint(name, &function, cudaEnableDefault);
#endif
  Check(status, "cudaGetDriverEntryPoint", Task{.stage = "device selection"});
  if (function == nullptr) {
    throw DeviceError(std::string("CUDA: the driver has no ") + name + "; update the driver, or run with --PhiStereo.backend cpu");
  }
  return reinterpret_cast<Function>(function);
}

// Which context a thread uses: to ask the runtime, or to tell it, may start a device.
struct ContextCalls {
  CUresult (*get)(CUcontext*) = FromDriver<CUresult (*)(CUcontext*)>("cuCtxGetCurrent");
  CUresult (*set)(CUcontext) = FromDriver<CUresult (*)(CUcontext)>("cuCtxSetCurrent");
};

const ContextCalls& Contexts() {
  static const ContextCalls calls;
  return calls;
}

}  // namespace

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

std::vector<int> DevicesNamed(std::vector<int> indices, int num_devices) {
  if (!indices.empty() && indices != std::vector<int>{-1}) return indices;
  indices.resize(static_cast<std::size_t>(num_devices));
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

void StartDevices(std::vector<int> indices) noexcept {
  const auto start = [](int index) {
    try {
      const ScopedDevice current(index);
      cudaFree(nullptr);
      cudaGetLastError();
    } catch (...) {
      // who needs it meets it again
    }
  };
  try {
    const int count = NumCudaDevices(nullptr);
    std::vector<std::jthread> threads;
    for (const int index : DevicesNamed(std::move(indices), count)) {
      if (index >= 0 && index < count) threads.emplace_back(start, index);
    }
  } catch (...) {
    // of the system: no thread, no memory
  }
}

ScopedDevice::ScopedDevice(int index) {
  const Task task{.stage = "device selection"};
  if (Contexts().get(&previous_) != CUDA_SUCCESS) previous_ = nullptr;  // the driver has not been started
  Check(cudaSetDevice(index), "cudaSetDevice", task);
  cudaGetLastError();  // of another user of this thread: the next launch would seem to have failed
}

ScopedDevice::~ScopedDevice() { Contexts().set(previous_); }

}  // namespace phi::gpu
