#include "cuda/error.h"

#include <cstdio>

#include "phi/base/c_locale.h"

namespace phi::gpu {
namespace {

constexpr char kRemedy[] =
    "; lower --PatchMatchStereo.max_image_size or --PhiStereo.num_source_views, end other programs on the "
    "GPU, or run with --PhiStereo.backend cpu";

std::string Megabytes(std::size_t bytes) {
  const CLocaleScope points_not_commas;
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f MB", static_cast<double>(bytes) / 1e6);
  return text;
}

}  // namespace

Message Task::Describe() const {
  Message message = "stage '" + std::string(stage) + "'";
  if (!image.empty()) message = message + " of image '" + AboutImage(image) + "'";
  if (width > 0) message.text += " (" + std::to_string(width) + "x" + std::to_string(height) + ")";
  return message;
}

void ThrowCudaError(cudaError_t status, const char* call, const Task& task) {
  cudaGetLastError();  // clears errors that are not sticky, so that the next image can go on
  Message message = std::string("CUDA: ") + call + " failed in " + task.Describe() + ": " +
                        cudaGetErrorString(status) + " (" + cudaGetErrorName(status) + ")";
  if (status == cudaErrorNoKernelImageForDevice || status == cudaErrorUnsupportedPtxVersion) {
    message.text +=
        "; this build has no code for this GPU: build with the preset 'package', or with its "
        "CMAKE_CUDA_ARCHITECTURES, or run with --PhiStereo.backend cpu";
  }
  if (status == cudaErrorMemoryAllocation) throw OutOfDeviceMemory(message + Message(kRemedy));
  throw DeviceError(message);
}

void ThrowTooLittleMemory(std::int64_t needed, std::int64_t budget, const Task& task) {
  throw TooLargeForDevice("out of memory in " + task.Describe() + ": it needs at least " +
                    Megabytes(static_cast<std::size_t>(needed)) + " of device memory, and " +
                    Megabytes(static_cast<std::size_t>(budget)) +
                    " are available (--PhiStereo.device_memory)" + kRemedy);
}

void CheckAllocation(cudaError_t status, const char* call, std::size_t bytes, const Task& task) {
  if (status == cudaSuccess) return;
  if (status != cudaErrorMemoryAllocation) ThrowCudaError(status, call, task);
  cudaGetLastError();
  std::size_t free = 0, total = 0;
  std::string available;
  if (cudaMemGetInfo(&free, &total) == cudaSuccess) {
    available = ", " + Megabytes(free) + " of the GPU's " + Megabytes(total) + " are free";
  }
  throw OutOfDeviceMemory("out of memory in " + task.Describe() + ": " + call + " needs " + Megabytes(bytes) +
                          available + kRemedy);
}

}  // namespace phi::gpu
