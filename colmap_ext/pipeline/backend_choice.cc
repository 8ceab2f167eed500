#include "colmap_ext/pipeline/backend_choice.h"

#include <charconv>
#include <sstream>

#include "colmap_ext/byte_count.h"
#include "colmap_ext/processor_limit.h"
#include "phi/base/device_error.h"
#include "phi/base/log.h"
#ifdef PHIMVS_WITH_CUDA
#include "cuda/cuda_backend.h"
#include "cuda/device.h"
#endif

namespace colmap_ext {
namespace {

#ifdef PHIMVS_WITH_CUDA
Backends MakeCuda(const std::vector<int>& gpu_indices, double budget_gigabytes, std::int64_t num_pixels) {
  return phi::gpu::MakeCudaBackends(gpu_indices, ByteCount(kBytesPerGigabyte * budget_gigabytes), num_pixels);
}
#else
Backends MakeCuda(const std::vector<int>&, double, std::int64_t) {
  throw phi::NoDeviceError(
      "this build has no CUDA backend; build it where nvcc is installed, or use --PhiStereo.backend cpu");
}
#endif

Backends MakeCpu(const BackendOptions& options) {
  Backends backends;
  backends.push_back(phi::MakeCpuBackend(options.num_threads > 0 ? options.num_threads : NumProcessors()));
  return backends;
}

}  // namespace

phi::OptionList BackendOptions::List() {
  constexpr const char* kSameMaps = "the maps are the same";
  phi::OptionList list;
  list.AddChoice<BackendKind>(
          "PhiStereo.backend", &kind,
          {{"auto", BackendKind::kAuto}, {"cuda", BackendKind::kCuda}, {"cpu", BackendKind::kCpu}},
          "Where to compute; auto = on the GPUs, or on the CPU where there is none")
      .NotInKey("a GPU's maps are as good as the CPU's");
  list.Add("PatchMatchStereo.gpu_index", &gpu_index, "GPUs to use: -1 = all, or a list such as 0,1")
      .ColmapDefault("-1")
      .NotInKey(kSameMaps);
  list.Add("PhiStereo.device_memory", &device_memory_gigabytes,
           "Memory to use on each GPU; -1 = what is free. With little the run is slower, the maps are the same")
      .Unit("GB")
      .NotInKey(kSameMaps);
  list.Add("PatchMatchStereo.num_threads", &num_threads, "Threads of the CPU; -1 = all cores")
      .ColmapDefault("-1")
      .Between(-1, phi::kMaxThreads)
      .NotInKey(kSameMaps);
  return list;
}

std::vector<int> ParseGpuIndices(const std::string& text) {
  std::vector<int> indices;
  std::stringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t first = part.find_first_not_of(' ');
    const std::size_t last = part.find_last_not_of(' ');
    const std::string number = first == std::string::npos ? "" : part.substr(first, last - first + 1);
    int index = 0;
    const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), index);
    if (error != std::errc() || stop != number.data() + number.size() || index < -1) {
      throw phi::UsageError("--PatchMatchStereo.gpu_index is '" + text +
                            "', but must be -1 (all) or a list such as 0,1");
    }
    indices.push_back(index);
  }
  if (indices.empty()) throw phi::UsageError("--PatchMatchStereo.gpu_index must not be empty");
  return indices;
}

Backends MakeBackends(const BackendOptions& options, std::int64_t num_pixels) {
  if (options.device_memory_gigabytes <= 0 && options.device_memory_gigabytes != -1) {
    throw phi::UsageError("--PhiStereo.device_memory is " + std::to_string(options.device_memory_gigabytes) +
                          ", but must be positive, or -1 for what is free");
  }
  const std::vector<int> gpu_indices = ParseGpuIndices(options.gpu_index);
  if (options.kind == BackendKind::kCpu) return MakeCpu(options);
  if (options.kind == BackendKind::kCuda) {
    return MakeCuda(gpu_indices, options.device_memory_gigabytes, num_pixels);
  }
  try {
    return MakeCuda(gpu_indices, options.device_memory_gigabytes, num_pixels);
  } catch (const phi::NoDeviceError& error) {
    phi::LogInfo(std::string("the CPU is used: ") + error.what());
    return MakeCpu(options);
  } catch (const phi::DeviceError&) {  // its reasons were told
    phi::LogWarning("no GPU of this machine works: the CPU does everything, which takes many times as long");
    return MakeCpu(options);
  } catch (const phi::ResourceError& error) {
    phi::LogWarning(std::string("the CPU is used, because no GPU can be: ") + error.what());
    return MakeCpu(options);
  }
}

GpuStart::GpuStart(const BackendOptions& options) {
  if (options.kind == BackendKind::kCpu) return;
  const std::vector<int> indices = ParseGpuIndices(options.gpu_index);
#ifdef PHIMVS_WITH_CUDA
  beside_.StartIfPossible([indices] { phi::gpu::StartDevices(indices); });
#endif
}

int NumAtOnce(const Backends& backends) {
  int num = 0;
  for (const auto& backend : backends) num += backend->NumConcurrentImages();
  return num;
}

}  // namespace colmap_ext
