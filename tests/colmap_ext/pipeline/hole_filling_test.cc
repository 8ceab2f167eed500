#include "colmap_ext/pipeline/hole_filling.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <tuple>
#include <vector>

#include "colmap_ext/byte_count.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/progress.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "tests/support/error_message.h"
#include "tests/support/fake_backend.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/run_pipeline.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::HashMaps;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr int kNumImages = 5;

// Measured maps that the stereo left; the fake's inference gives holes depths that the stereo's filter has dropped.
class HoleFillingTest : public ::testing::Test {
 protected:
  void SetUp() override {
    names_ = test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = kNumImages});
    PipelineOptions off = options_;
    off.inference.mode = phi::InferenceMode::kOff;
    test_support::FakeCalls calls;
    test_support::RunPipeline({.path = folder_.path()}, off,
                              test_support::MakeFakeBackends(&calls, 1, 1));
  }
  void TearDown() override { phi::CancellationFlag() = false; }

  RunSummary Fill() {
    const Workspace workspace({.path = folder_.path()});
    const phi::SparseScene scene = MakeSparseScene(workspace.model());
    const Backends backends = test_support::MakeFakeBackends(&calls_, num_backends_, num_concurrent_);
    HoleFilling filling(workspace, MakeImageJobs(workspace, scene, "", options_.view_selection), options_, {},
                        backends);
    return filling.Run();
  }

  test_support::TemporaryFolder folder_;
  std::vector<std::string> names_;
  PipelineOptions options_;
  test_support::FakeCalls calls_;
  int num_backends_ = 1, num_concurrent_ = 1;
};

TEST_F(HoleFillingTest, AnImageGoesOnWhenWhatItReadsIsThere) {
  test_support::ReadNeighboursAlone(folder_.path(), names_);
  const test_support::CallOrder order(&calls_);
  EXPECT_TRUE(Fill().failures.empty());
  EXPECT_EQ(order.size(), 2u * kNumImages);
  for (int i = 0; i < kNumImages; ++i)
    EXPECT_GT(order.Place("filter", names_[i]), order.Place("infer", names_[i == 0 ? 1 : i - 1]));
  EXPECT_LT(order.Place("filter", names_[0]), order.Place("infer", names_[kNumImages - 1]));
}

TEST_F(HoleFillingTest, OnlyAnotherProgramsMapsKeepAllThatWasMeasured) {
  std::atomic<int> num_kept = 0;
  calls_.on_infer = [&](const phi::InferenceInput& input) { num_kept += input.keeps_measured; };
  EXPECT_TRUE(Fill().failures.empty());
  EXPECT_EQ(calls_.inferences, kNumImages);
  EXPECT_EQ(num_kept, 0);
  // Without our records, masks and measured maps the geometric maps are anybody's.
  std::filesystem::remove(folder_.path() / "stereo/phimvs.json");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path() / "stereo")) {
    const std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && !name.ends_with(".geometric.bin") && !name.ends_with(".cfg")) std::filesystem::remove(entry.path());
  }
  options_.overwrite = true;
  EXPECT_TRUE(Fill().failures.empty());
  EXPECT_EQ(num_kept, kNumImages);
}

TEST_F(HoleFillingTest, FilledMapsNeedNoCosts) {
  options_.filter.min_ncc = 0.1;
  EXPECT_TRUE(Fill().failures.empty());
}

TEST_F(HoleFillingTest, BytesDependNeitherOnWorkersNorOnMemory) {
  Fill();
  const auto expected = HashMaps(folder_.path());
  EXPECT_THAT(expected, SizeIs(kNumImages * 8));
  calls_.duration = std::chrono::milliseconds(2);
  for (const auto& [num_backends, num_concurrent, cache_bytes] : {std::tuple{1, 3, std::int64_t{1} << 30},
                                                                  {3, 2, std::int64_t{1} << 30},
                                                                  {1, 1, std::int64_t{1}},
                                                                  {2, 2, std::int64_t{20000}}}) {
    num_backends_ = num_backends;
    num_concurrent_ = num_concurrent;
    options_.cache_gigabytes = static_cast<double>(cache_bytes) / kBytesPerGigabyte;
    EXPECT_TRUE(Fill().failures.empty());
    EXPECT_EQ(HashMaps(folder_.path()), expected)
        << num_backends << " x " << num_concurrent << ", " << cache_bytes;
  }
}

TEST_F(HoleFillingTest, CacheKeepsItsBudget) {
  const std::int64_t map_bytes = 24 * 16 * 16;
  options_.cache_gigabytes = 3 * map_bytes / kBytesPerGigabyte;
  // Above the budget only what waits to be written: two writers, as many jobs queued, and the one just made.
  EXPECT_LE(Fill().peak_cache_bytes, (3 + 5) * map_bytes);
}

TEST_F(HoleFillingTest, AnImageThatFailsLeavesTheOthersDone) {
  num_concurrent_ = 2;
  for (const std::string stage : {"infer", "filter"}) {
    calls_.on_call = [&](const std::string& called, const std::string& image) {
      if (called == stage && image == names_[1]) throw phi::InputError("no luck with " + image);
    };
    const RunSummary summary = Fill();
    ASSERT_THAT(summary.failures, SizeIs(1));
    EXPECT_EQ(summary.failures[0].image, names_[1]);
    EXPECT_THAT(summary.failures[0].text, HasSubstr("no luck"));
    EXPECT_EQ(summary.failures[0].stage, stage == "infer" ? "inferred" : "geometric");
    EXPECT_EQ(summary.failures[0].file, "");
    EXPECT_EQ(summary.stages.back().num_made, kNumImages - 1);
    for (int i = 0; i < kNumImages; ++i) {
      const auto filled = folder_ / "stereo/filled_masks" / (names_[i] + ".png");
      EXPECT_EQ(std::filesystem::exists(filled), i != 1) << stage << " " << filled;
    }
  }
}

TEST_F(HoleFillingTest, AnImageWithoutAFileFailsOrIsLeftOutWhereThatIsAllowed) {
  std::filesystem::remove(folder_ / "images" / names_[1]);
  const RunSummary failed = Fill();
  EXPECT_EQ(failed.Code(), phi::ExitCode::kSomeImagesFailed);
  ASSERT_THAT(failed.failures, SizeIs(1));
  EXPECT_THAT(failed.failures[0].text, HasSubstr(names_[1] + " is missing"));
  EXPECT_EQ(failed.NumMade(), kNumImages - 1);
  options_.allow_missing_files = true;
  const RunSummary left_out = Fill();
  EXPECT_EQ(left_out.Code(), phi::ExitCode::kOk);
  EXPECT_EQ(left_out.num_images, kNumImages - 1);
  EXPECT_EQ(left_out.NumMade(), kNumImages - 1);
  std::filesystem::remove_all(folder_ / "images");
  const phi::Message none = test_support::WholeMessageOf<phi::InputError>([&] { Fill(); });
  EXPECT_THAT(none.text, HasSubstr("no image can be done: image " + names_[0]));
  EXPECT_EQ(none.stage, "measured");  // as of the images that fail
}

// Of another program's maps, which had not come to it.
TEST_F(HoleFillingTest, AnImageWithoutMapsIsNotCounted) {
  std::filesystem::remove(folder_ / "stereo/phimvs.json");
  options_.overwrite = true;
  for (const char* kind : {"measured", "geometric"}) {
    for (const char* maps : {"depth_maps", "normal_maps"})
      std::filesystem::remove(folder_ / "stereo" / maps / (names_[1] + "." + kind + ".bin"));
  }
  std::filesystem::remove(folder_ / "stereo/filled_masks" / (names_[1] + ".png"));
  const RunSummary summary = Fill();
  EXPECT_TRUE(summary.failures.empty());
  EXPECT_EQ(summary.num_images, kNumImages - 1);
}

TEST_F(HoleFillingTest, StopsWhenAskedToAndGoesOn) {
  Fill();
  const auto expected = HashMaps(folder_.path());
  int num_calls = 0;
  calls_.on_call = [&](const std::string&, const std::string&) {
    if (++num_calls == 4) phi::CancellationFlag() = true;
  };
  EXPECT_THROW(Fill(), phi::Cancelled);
  EXPECT_EQ(num_calls, 4);
  phi::CancellationFlag() = false;
  EXPECT_TRUE(Fill().failures.empty());
  EXPECT_EQ(HashMaps(folder_.path()), expected);
}

// Some images are filtered before those that read the failed one are planned again.
TEST_F(HoleFillingTest, ProgressCountsWhatIsDoneAlsoAfterAFailure) {
  test_support::ReadNeighboursAlone(folder_.path(), names_);
  ProgressState last;
  SetProgressSink([&](const ProgressState& state) { last = state; });
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "infer" && image == names_[1]) throw phi::InputError("no luck with " + image);
  };
  Fill();
  SetProgressSink(nullptr);
  EXPECT_EQ(last.stage, "filtering");
  EXPECT_EQ(last.num_done, kNumImages - 1);
  EXPECT_EQ(last.num_tasks, kNumImages - 1);
  EXPECT_EQ(last.fraction, 1);
}

}  // namespace
}  // namespace colmap_ext
