#include "colmap_ext/fusion/fusion_backend.h"

#include <algorithm>
#include <string>

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
std::unique_ptr<phi::FusionDevice> MakeCuda(const FusionGpu& gpu) {
  std::string why_none;
  const int num_gpus = phi::gpu::NumCudaDevices(&why_none);
  if (num_gpus == 0) throw phi::NoDeviceError(why_none + "; --PhiFusion.backend cpu needs none");
  if (gpu.index >= num_gpus) throw phi::NoDeviceError("fusion: there is no GPU " + std::to_string(gpu.index));
  return phi::gpu::MakeCudaFusion(gpu.index, gpu.memory_bytes);
}
#else
std::unique_ptr<phi::FusionDevice> MakeCuda(const FusionGpu&) {
  throw phi::NoDeviceError("this build has no CUDA backend; build it where nvcc is installed, or use --PhiFusion.backend cpu");
}
#endif

}  // namespace

FusionGpu FirstGpu(const BackendOptions& stereo) {
  FusionGpu gpu;
  gpu.index = std::max(ParseGpuIndices(stereo.gpu_index).front(), 0);  // -1: all
  if (stereo.device_memory_gigabytes > 0) gpu.memory_bytes = ByteCount(kBytesPerGigabyte * stereo.device_memory_gigabytes);
  return gpu;
}

std::unique_ptr<phi::FusionDevice> MakeFusionDevice(FusionBackend backend, const FusionGpu& gpu, std::int64_t num_lookups) {
  if (backend == FusionBackend::kCpu) return nullptr;
  if (backend == FusionBackend::kCuda) return MakeCuda(gpu);
  const double seconds = static_cast<double>(num_lookups) * kSecondsPerLookup / NumProcessors();
  if (seconds < kSecondsToStartGpu) return nullptr;
  try {
    return MakeCuda(gpu);
  } catch (const phi::NoDeviceError& error) {
    phi::LogDebug(error.what());
  } catch (const phi::ResourceError& error) {
    phi::LogWarning(std::string(error.what()) + "; the processor does fusion");
  }
  return nullptr;
}

}  // namespace colmap_ext
