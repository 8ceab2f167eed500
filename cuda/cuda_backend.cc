#include "cuda/cuda_backend.h"

#include <cstdio>
#include <numeric>
#include <string>
#include <utility>

#include "cuda/device_resources.h"
#include "cuda/self_test.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace phi::gpu {

DeviceResources::DeviceResources(const DeviceProperties& p)
    : properties(p),
      images(p.total_memory / 4,
             [](const GrayImage& image, cudaStream_t stream) {
               const Task task{"image upload", "", image.width(), image.height()};
               return std::make_shared<const GrayPyramid>(image, stream, task);
             }),
      maps(p.total_memory / 4,
           [](const PlaneMap& map, cudaStream_t stream) {
             const Task task{"map upload", "", map.width(), map.height()};
             return std::make_shared<const DeviceMap>(map, stream, task);
           }),
      depths(p.total_memory / 4,
             [](const PlaneMap& map, cudaStream_t stream) {
               const Task task{"depth map upload", "", map.width(), map.height()};
               return std::make_shared<const DeviceDepths>(map, stream, task);
             }),
      times(Task{"set-up"}) {}

void DeviceResources::NoteMemory(const Task& task) {
  std::size_t free = 0, total = 0;
  Check(cudaMemGetInfo(&free, &total), "cudaMemGetInfo", task);
  const std::int64_t now = static_cast<std::int64_t>(total - free);
  std::int64_t peak = peak_bytes;
  while (now > peak && !peak_bytes.compare_exchange_weak(peak, now)) {
  }
}

namespace {

class CudaBackend : public Backend {
  // Once more with empty caches when memory ran out.
  template <class Function>
  auto OnDevice(const Function& function) {
    const ScopedDevice current(device_->properties.index);
    try {
      return function();
    } catch (const OutOfDeviceMemory& error) {
      LogDebug(std::string(error.what()) + "; trying again without cached images and maps");
    }
    device_->images.Clear();
    device_->maps.Clear();
    device_->depths.Clear();
    return function();
  }

 public:
  explicit CudaBackend(const DeviceProperties& properties)
      : device_(std::make_unique<DeviceResources>(properties)) {}

  ~CudaBackend() override {
    LogTimes();
    const ScopedDevice current(device_->properties.index);
    device_.reset();
  }

  std::string Name() const override {
    return "cuda:" + std::to_string(device_->properties.index) + " " + device_->properties.name;
  }

  int NumConcurrentImages() const override { return 2; }

  std::int64_t PeakDeviceBytes() const override { return device_->peak_bytes; }

  std::vector<DeviceStageTime> DeviceStageTimes() const override {
    std::vector<DeviceStageTime> times;
    for (const auto& [name, stage] : {std::pair{"estimation", DeviceTimes::kEstimation},
                                      {"inference", DeviceTimes::kInference},
                                      {"filter", DeviceTimes::kFilter}}) {
      const StageTime& time = device_->times.stage(stage);
      if (time.num_images() > 0)
        times.push_back({name, time.num_images(), time.BusySeconds(), time.samples()});
    }
    return times;
  }

  EstimationResult Estimate(const EstimationInput& input, const StereoOptions& options) override {
    return OnDevice([&] { return EstimateOnGpu(device_.get(), input, options); });
  }

  PlaneMap Filter(const FilterInput& input, const FilterOptions& options) override {
    return OnDevice([&] { return FilterOnGpu(device_.get(), input, options); });
  }

  InferenceResult Infer(const InferenceInput& input, const StereoOptions& stereo,
                        const InferenceOptions& options) override {
    return OnDevice([&] { return InferOnGpu(device_.get(), input, stereo, options); });
  }

 private:
  void LogTimes() const {
    LogStage("estimation", DeviceTimes::kEstimation);
    LogStage("inference", DeviceTimes::kInference);
    LogStage("filter", DeviceTimes::kFilter);
  }

  void LogStage(const char* name, DeviceTimes::Stage stage) const {
    const StageTime& time = device_->times.stage(stage);
    if (time.num_images() == 0) return;
    char text[160];
    std::snprintf(text, sizeof(text), ": %s of %d images, %.4f s of device time each", name,
                  time.num_images(), time.BusySeconds() / time.num_images());
    LogInfo(Name() + text + Rate(time));
  }

  // Some samples are read beside the texture units, so that their share may exceed 100 %.
  std::string Rate(const StageTime& time) const {
    if (!(time.samples() > 0)) return "";
    char text[128];
    const double rate = time.samples() / time.BusySeconds(), ceiling = device_->properties.texture_rate;
    int length = std::snprintf(text, sizeof(text), ", %.3g ZNCC samples/s", rate);
    if (ceiling > 0) {
      std::snprintf(text + length, sizeof(text) - length, ", %.0f %% of the texture units' fetch ceiling",
                    100 * rate / ceiling);
    }
    return text;
  }

  std::unique_ptr<DeviceResources> device_;
};

}  // namespace

std::vector<std::unique_ptr<Backend>> MakeCudaBackends(const std::vector<int>& gpu_indices) {
  std::vector<int> indices = gpu_indices;
  if (indices.empty() || indices == std::vector<int>{-1}) {
    indices.resize(NumCudaDevices(nullptr));
    std::iota(indices.begin(), indices.end(), 0);
  }
  std::vector<std::unique_ptr<Backend>> backends;
  for (const int index : indices) {
    const DeviceProperties properties = QueryDevice(index);
    RequireWorkingDevice(properties);
    const ScopedDevice current(index);
    backends.push_back(std::make_unique<CudaBackend>(properties));
  }
  return backends;
}

}  // namespace phi::gpu
