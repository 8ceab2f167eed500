#include "colmap_ext/fusion/fusion_backend.h"

#include <cstddef>
#include <string>
#include <vector>

#include "colmap_ext/byte_count.h"
#include "colmap_ext/processor_limit.h"
#include "phi/base/device_error.h"
#include "phi/base/log.h"
#ifdef PHIMVS_WITH_CUDA
#include "cuda/device.h"
#include "cuda/fuse_on_gpu.h"
#endif

namespace colmap_ext {
namespace {

// Of one core. Measured: 6 (maps of 1 megapixel) to 17 (6 megapixels).
constexpr double kSecondsPerLookup = 10e-9;
// Measured: 0.2 to 0.4.
constexpr double kSecondsToStartGpu = 0.3;

#ifdef PHIMVS_WITH_CUDA
std::unique_ptr<phi::FusionDevice> MakeCuda(const FusionGpus& gpus) {
  std::string why_none;
  const int num_gpus = phi::gpu::NumCudaDevices(&why_none);
  if (num_gpus == 0) throw phi::NoDeviceError(why_none + "; --PhiFusion.backend cpu needs none");
  const std::vector<int> indices = phi::gpu::DevicesNamed(gpus.indices, num_gpus);
  for (std::size_t i = 0;; ++i) {
    const int index = indices[i];
    if (index >= num_gpus) throw phi::NoDeviceError("fusion: there is no GPU " + std::to_string(index));
    try {
      return phi::gpu::MakeCudaFusion(index, gpus.memory_bytes);
    } catch (const phi::DeviceError& error) {
      if (i + 1 == indices.size()) throw;
      phi::LogWarning("fusion: GPU " + std::to_string(index) + " is left out: " + error.what());
    }
  }
}
#else
std::unique_ptr<phi::FusionDevice> MakeCuda(const FusionGpus&) {
  throw phi::NoDeviceError("this build has no CUDA backend; build it where nvcc is installed, or use --PhiFusion.backend cpu");
}
#endif

}  // namespace

FusionGpus GpusOf(const BackendOptions& stereo) {
  FusionGpus gpus{.indices = ParseGpuIndices(stereo.gpu_index)};
  if (gpus.indices.front() < 0) gpus.indices.clear();  // -1: all
  if (stereo.device_memory_gigabytes > 0) gpus.memory_bytes = ByteCount(kBytesPerGigabyte * stereo.device_memory_gigabytes);
  return gpus;
}

std::unique_ptr<phi::FusionDevice> MakeFusionDevice(FusionBackend backend, const FusionGpus& gpus, std::int64_t num_lookups) {
  if (backend == FusionBackend::kCpu) return nullptr;
  if (backend == FusionBackend::kCuda) return MakeCuda(gpus);
  const double seconds = static_cast<double>(num_lookups) * kSecondsPerLookup / NumProcessors();
  if (seconds < kSecondsToStartGpu) return nullptr;
  try {
    return MakeCuda(gpus);
  } catch (const phi::NoDeviceError& error) {
    phi::LogDebug(error.what());
  } catch (const phi::ResourceError& error) {
    phi::LogWarning(std::string(error.what()) + "; the processor does fusion");
  }
  return nullptr;
}

}  // namespace colmap_ext
