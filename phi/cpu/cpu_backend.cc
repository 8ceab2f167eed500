// The CPU backend: TBB over rows. Nothing depends on the number of threads.
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "phi/backend.h"
#include "phi/cpu/cpu_estimation.h"
#include "phi/cpu/cpu_filter.h"
#include "phi/cpu/cpu_sharing.h"
#include "phi/inference/infer.h"

namespace phi {
namespace {

// Of the cores that it was measured on; they differ by a factor of two or so.
constexpr double kPixelViewsPerSecondAndThread = 0.17e6;

class CpuBackend : public Backend {
 public:
  explicit CpuBackend(int num_threads)
      : num_threads_(num_threads > 0 ? num_threads : tbb::info::default_concurrency()),
        arena_(num_threads_) {}

  std::string Name() const override {
    return "cpu (" + std::to_string(num_threads_) + (num_threads_ == 1 ? " thread)" : " threads)");
  }

  int NumConcurrentImages() const override { return 1; }

  double ExpectedPixelViewsPerSecond() const override { return kPixelViewsPerSecondAndThread * num_threads_; }

  EstimationResult Estimate(const EstimationInput& input, const StereoOptions& options) override {
    EstimationResult result;
    arena_.execute([&] { result = EstimateOnCpu(input, options); });
    return result;
  }

  std::shared_ptr<const MeasurementMap> Share(const SharingInput& input, const StereoOptions& options) override {
    MeasurementMap result;
    arena_.execute([&] { result.planes = ShareOnCpu(input, options); });
    return std::make_shared<const MeasurementMap>(std::move(result));
  }

  MeasurementMap Filter(const FilterInput& input, const FilterOptions& options) override {
    MeasurementMap result;
    arena_.execute([&] { result = FilterOnCpu(input, options); });
    return result;
  }

  InferenceResult Infer(const InferenceInput& input, const StereoOptions& stereo,
                        const InferenceOptions& options) override {
    return arena_.execute([&] { return InferPlanes(input, stereo, options); });
  }

  void RunOnHost(const std::function<void()>& work) override { arena_.execute(work); }

 private:
  int num_threads_;
  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<Backend> MakeCpuBackend(int num_threads) { return std::make_unique<CpuBackend>(num_threads); }

}  // namespace phi
