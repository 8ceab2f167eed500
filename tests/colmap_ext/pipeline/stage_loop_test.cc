#include "colmap_ext/pipeline/stage_loop.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <string>
#include <thread>
#include <vector>

#include "colmap_ext/pipeline/image_jobs.h"
#include "tests/support/fake_backend.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using namespace std::chrono_literals;
using test_support::FakeCalls;

constexpr int kNumImages = 3;

class StageLoopTest : public ::testing::Test {
 protected:
  void SetUp() override { test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = kNumImages}); }

  // The estimations during which the image's regions came into memory, of a device that waits so long for them.
  int CountRegionsFoundMeanwhile(int num_concurrent, std::size_t num_stages, std::chrono::milliseconds longest_wait) {
    const Workspace workspace({.path = folder_.path()});
    const phi::SparseScene scene = MakeSparseScene(workspace.model());
    const std::vector<ImageJob> jobs = MakeImageJobs(workspace, scene, "", options_.view_selection);
    FakeCalls calls;
    const Backends backends = test_support::MakeFakeBackends(&calls, 1, num_concurrent);
    StageLoop loop(workspace, jobs, options_, [](int) { return phi::SparseDepth{{}, {1, 10}}; }, backends, 1 << 30);
    std::atomic<int> num_found{0};
    calls.on_estimate = [&](const phi::EstimationInput& input) {
      const auto image = static_cast<int>(input.reference.view - workspace.views().data());
      const auto are_there = [&] { return loop.store().cache().Find({image, "regions"}) != nullptr; };
      const auto end = std::chrono::steady_clock::now() + longest_wait;
      while (!are_there() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
      num_found += are_there();
    };
    const int end_stage = static_cast<int>(num_stages);
    loop.Begin(BuildStages(options_));
    const auto plan = loop.Plan({.is_done = [](int, int, const std::string&) { return false; },
                                 .has_failed = [](int, int, const std::string&) { return false; }},
                                {.own = {}, .first_stage = 0, .end_stage = end_stage});
    const auto keep = [&](int stage, int job, const TaskOutcome& outcome) {
      loop.store().KeepInMemory(jobs[job].image, loop.stages()[stage].result, outcome.result);
    };
    loop.Run(plan, end_stage, keep, [](const JobFailure& failure) { ADD_FAILURE() << failure.message.text; });
    loop.End();
    EXPECT_EQ(calls.estimates, kNumImages);
    return num_found;
  }

  test_support::TemporaryFolder folder_;
  PipelineOptions options_;
};

TEST_F(StageLoopTest, TheHostFindsRegionsWhileADeviceEstimates) {
  EXPECT_EQ(CountRegionsFoundMeanwhile(2, BuildStages(options_).size(), 10s), kNumImages);
}

// The processor has enough to do.
TEST_F(StageLoopTest, ABackendThatIsTheHostFindsNoneMeanwhile) {
  EXPECT_EQ(CountRegionsFoundMeanwhile(1, BuildStages(options_).size(), 50ms), 0);
}

TEST_F(StageLoopTest, NobodyFindsRegionsThatNoInferenceWillAskFor) {
  EXPECT_EQ(CountRegionsFoundMeanwhile(2, 1, 50ms), 0);
}

}  // namespace
}  // namespace colmap_ext
