// Which devices run: --PhiStereo.backend and --PatchMatchStereo.gpu_index.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/thread_group.h"
#include "phi/backend.h"

namespace colmap_ext {

enum class BackendKind { kAuto, kCuda, kCpu };

struct BackendOptions {
  BackendKind kind = BackendKind::kAuto;
  std::string gpu_index = "-1";         // COLMAP's spelling: -1 = all GPUs, or 0,1,...
  double device_memory_gigabytes = -1;  // on each GPU; -1 = what is free
  int num_threads = -1;                 // of the CPU backend; <= 0: all

  phi::OptionList List();
};

using Backends = std::vector<std::unique_ptr<phi::Backend>>;

// "0,1" -> {0, 1}; "-1" -> {-1}. Throws phi::UsageError.
std::vector<int> ParseGpuIndices(const std::string& text);

// At least one backend. num_pixels: of the largest image, by which a GPU takes more or fewer at once; 0: not known. Logs why the CPU
// runs where a GPU could have been meant. Throws phi::NoDeviceError when CUDA is asked for and this build or this machine has none,
// phi::ResourceError where one fails.
Backends MakeBackends(const BackendOptions& options, std::int64_t num_pixels = 0);

// Starts, on a thread, the GPUs that MakeBackends will use: that takes some tenths of a second. The destructor waits for it.
class GpuStart {
 public:
  // Throws phi::UsageError for indices that are none; all that else fails comes up in MakeBackends.
  explicit GpuStart(const BackendOptions& options);

 private:
  ThreadGroup beside_;
};

// Calls of one stage that keep all of them busy.
int NumAtOnce(const Backends& backends);

}  // namespace colmap_ext
