#include "cuda/cuda_backend.h"

#include <cstdio>
#include <string>

#include "cuda/calls_on_gpu.h"
#include "cuda/fetch_rate.h"
#include "cuda/self_test.h"
#include "phi/base/c_locale.h"
#include "phi/base/device_error.h"
#include "phi/base/log.h"
#include "phi/working_backends.h"

namespace phi::gpu {

namespace {

// Of an H200.
constexpr double kPixelViewsPerSecondAndProcessor = 0.7e6;

class CudaBackend : public Backend {
  // Once more, alone, where memory ran out although the budget allowed the call, or where the budget had been lowered for that.
  template <class Function>
  auto OnDevice(const Function& function) {
    const ScopedDevice current(device_->properties.index);
    try {
      return function();
    } catch (const OutOfDeviceMemory& error) {
      LogDebug(std::string(error.what()) + "; trying again by itself");
    } catch (const TooLargeForDevice&) {
      if (!device_->budget.IsLowered()) throw;
    }
    const MemoryBudget::Alone alone(&device_->budget);
    device_->LookForMemory(Task{"search for memory"});
    return function();
  }

 public:
  CudaBackend(const DeviceProperties& properties, std::int64_t budget_bytes, std::int64_t num_pixels)
      : device_(std::make_unique<DeviceResources>(properties, budget_bytes, num_pixels)) {}

  ~CudaBackend() override {
    try {
      const ScopedDevice current(device_->properties.index);
      LogTimes();
      device_.reset();
    } catch (const DeviceError& error) {  // it failed before; what it holds goes with the process
      LogDebug(error.what());
    }
  }

  std::string Name() const override {
    return "cuda:" + std::to_string(device_->properties.index) + " " + device_->properties.name;
  }

  int NumConcurrentImages() const override { return device_->num_concurrent_calls; }

  double ExpectedPixelViewsPerSecond() const override {
    return kPixelViewsPerSecondAndProcessor * device_->properties.num_multiprocessors;
  }

  void FreeMemory() override {
    try {
      const ScopedDevice current(device_->properties.index);
      device_->FreeIdle();
    } catch (const DeviceError& error) {
      LogDebug(error.what());
    }
  }

  std::int64_t PeakDeviceBytes() const override { return device_->peak_bytes; }

  std::vector<DeviceStageTime> DeviceStageTimes() const override {
    std::vector<DeviceStageTime> times;
    for (const CallKind kind : kCallKinds) {
      const KindTime& time = device_->times.Of(kind);
      if (time.num_images() > 0)
        times.push_back({NameOf(kind), time.num_images(), time.BusySeconds(), time.samples()});
    }
    return times;
  }

  EstimationResult Estimate(const EstimationInput& input, const StereoOptions& options) override {
    return OnDevice([&] { return EstimateOnGpu(device_.get(), input, options); });
  }

  std::shared_ptr<const MeasurementMap> Share(const SharingInput& input, const StereoOptions& options) override {
    return OnDevice([&] { return ShareOnGpu(device_.get(), input, options); });
  }

  MeasurementMap Filter(const FilterInput& input, const FilterOptions& options) override {
    return OnDevice([&] { return FilterOnGpu(device_.get(), input, options); });
  }

  InferenceResult Infer(const InferenceInput& input, const StereoOptions& stereo,
                        const InferenceOptions& options) override {
    return OnDevice([&] { return InferOnGpu(device_.get(), input, stereo, options); });
  }

 private:
  void LogTimes() const {
    if (GetLogLevel() < LogLevel::kDebug) return;  // the rate of bare fetches would be measured for nothing
    const CLocaleScope points_not_commas;
    for (const DeviceStageTime& time : DeviceStageTimes()) {
      char text[160];
      std::snprintf(text, sizeof(text), ": %s of %d images, %.4f s of device time each", time.stage.c_str(),
                    time.num_images, time.seconds / time.num_images);
      LogDebug(Name() + text + Rate(time));
    }
  }

  static std::string Rate(const DeviceStageTime& time) {
    if (!(time.num_samples > 0)) return "";
    char text[128];
    const double rate = time.num_samples / time.seconds;
    int length = std::snprintf(text, sizeof(text), ", %.3g ZNCC samples/s", rate);
    try {
      std::snprintf(text + length, sizeof(text) - length, ", %.0f %% of the rate measured for bare fetches",
                    100 * rate / MeasureFetchRate());
    } catch (const ResourceError& error) {  // the maps are done: no reason to fail
      LogDebug(error.what());
    }
    return text;
  }

  std::unique_ptr<DeviceResources> device_;
};

}  // namespace

std::vector<std::unique_ptr<Backend>> MakeCudaBackends(const std::vector<int>& gpu_indices, std::int64_t budget_bytes,
                                                       std::int64_t num_pixels) {
  std::string why_none;
  const std::vector<int> indices = DevicesNamed(gpu_indices, NumCudaDevices(&why_none));
  if (indices.empty()) throw NoDeviceError(why_none + "; --PhiStereo.backend cpu needs none");
  return MakeWorkingBackends(indices, [=](int index) {
    const DeviceProperties properties = QueryDevice(index);
    RequireWorkingDevice(properties);
    const ScopedDevice current(index);
    return std::make_unique<CudaBackend>(properties, budget_bytes, num_pixels);
  });
}

}  // namespace phi::gpu
