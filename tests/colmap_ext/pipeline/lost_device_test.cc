// A device that dies in mid-run, and one that was never whole: the run ends with the others, in the same bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "phi/base/device_error.h"
#include "tests/support/fake_backend.h"
#include "tests/support/log_capture.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/run_pipeline.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::FakeBackend;
using test_support::FakeCalls;
using test_support::HashMaps;
using test_support::TemporaryFolder;
using testing::Contains;
using testing::HasSubstr;

// Answers so many calls; every one after them fails, as those of a GPU do that fell off the bus.
class DyingBackend : public FakeBackend {
 public:
  DyingBackend(FakeCalls* calls, int num_calls) : FakeBackend(calls, 2), calls_left_(num_calls) {}
  std::string Name() const override { return "dying"; }
  phi::EstimationResult Estimate(const phi::EstimationInput& input,
                                 const phi::StereoOptions& options) override {
    TakeCall();
    return FakeBackend::Estimate(input, options);
  }
  phi::MeasurementMap Filter(const phi::FilterInput& input, const phi::FilterOptions& options) override {
    TakeCall();
    return FakeBackend::Filter(input, options);
  }
  phi::InferenceResult Infer(const phi::InferenceInput& input, const phi::StereoOptions& stereo,
                             const phi::InferenceOptions& options) override {
    TakeCall();
    return FakeBackend::Infer(input, stereo, options);
  }
  bool is_dead() const { return calls_left_ < 0; }

 private:
  void TakeCall() {
    if (--calls_left_ < 0) throw phi::DeviceError("the device fell off the bus");
  }
  std::atomic<int> calls_left_;
};

class LostDeviceTest : public ::testing::Test {
 protected:
  // Null: that the FakeBackend is alone.
  RunSummary Run(const std::filesystem::path& path, std::unique_ptr<DyingBackend> dying) {
    test_support::WriteNoiseWorkspace(path, {.num_images = 6});
    PipelineOptions options;
    Backends backends;
    if (dying) backends.push_back(std::move(dying));
    backends.push_back(std::make_unique<FakeBackend>(&calls_, 1));
    const RunSummary summary = test_support::RunPipeline({.path = path}, options, backends);
    if (backends.size() == 2) {
      EXPECT_TRUE(static_cast<const DyingBackend&>(*backends.front()).is_dead());
    }
    return summary;
  }

  FakeCalls calls_;
};

TEST_F(LostDeviceTest, WhereverADeviceDiesTheOthersMakeTheSameBytes) {
  const TemporaryFolder clean;
  Run(clean.path(), nullptr);
  calls_.duration = std::chrono::milliseconds(2);  // both devices get work
  for (const int num_calls : {0, 1, 4, 8}) {
    const test_support::LogCapture log;
    const TemporaryFolder folder;
    EXPECT_TRUE(Run(folder.path(), std::make_unique<DyingBackend>(&calls_, num_calls)).failures.empty());
    EXPECT_EQ(HashMaps(folder.path()), HashMaps(clean.path())) << num_calls << " calls";
    EXPECT_THAT(log.messages(), Contains(HasSubstr("dying is left out, and the other devices do its images: "
                                                   "the device fell off the bus")));
  }
}

}  // namespace
}  // namespace colmap_ext
