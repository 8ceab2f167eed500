// Parts of the images in processes of their own: in any order, stopped and started again, they leave the maps of one run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "colmap_ext/map_file.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/run_status.h"
#include "colmap_ext/pipeline/stale_maps.h"
#include "colmap_ext/pipeline/stereo_pipeline.h"
#include "phi/base/error.h"
#include "tests/support/error_message.h"
#include "tests/support/fake_backend.h"
#include "tests/support/log_capture.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::FakeBackend;
using test_support::FakeCalls;
using test_support::HashMaps;
using test_support::InputErrorOf;
using test_support::TemporaryFolder;
using ::testing::HasSubstr;

constexpr int kNumImages = 6;

class ShardPipelineTest : public ::testing::Test {
 protected:
  void SetUp() override {
    names_ = test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = kNumImages});
  }

  RunSummary Run(const fs::path& path, const Shard& shard = {}) {
    const Workspace workspace({.path = path});
    const phi::SparseScene scene = MakeSparseScene(workspace.model());
    Backends backends;
    backends.push_back(std::make_unique<FakeBackend>(&calls_, 1));
    const auto sparse_depth = [](int) { return phi::SparseDepth{{}, {1, 10}}; };
    StereoPipeline pipeline({workspace, MakeImageJobs(workspace, scene, "", options_.view_selection), sparse_depth},
                            options_, {}, backends, shard);
    return pipeline.Run();
  }
  phi::ExitCode RunShard(int index, int count, const std::string& stage = "") {
    return Run(folder_.path(), {.index = index, .count = count, .only_stage = stage}).Code();
  }

  std::vector<std::string> CleanMaps() {
    const TemporaryFolder clean;
    test_support::WriteNoiseWorkspace(clean.path(), {.num_images = kNumImages});
    Run(clean.path());
    calls_.estimates = calls_.filters = calls_.inferences = 0;
    return HashMaps(clean.path());
  }

  TemporaryFolder folder_;
  std::vector<std::string> names_;
  PipelineOptions options_;
  FakeCalls calls_;
};

TEST_F(ShardPipelineTest, StageByStageAreTheMapsOfOneRun) {
  const std::vector<std::string> clean = CleanMaps();
  for (const char* stage : {"photometric", "shared", "measured", "inferred", "geometric"}) {
    for (const int shard : {2, 0, 3, 1}) EXPECT_EQ(RunShard(shard, 4, stage), phi::ExitCode::kOk) << stage;
  }
  EXPECT_EQ(calls_.estimates, kNumImages);
  EXPECT_EQ(calls_.inferences, kNumImages);
  EXPECT_FALSE(fs::exists(folder_ / "stereo/phimvs.json")) << "shards leave it alone";
  EXPECT_EQ(Run(folder_.path()).num_images_kept, kNumImages) << "the next run takes over what they noted";
  EXPECT_EQ(calls_.estimates, kNumImages);
  EXPECT_EQ(HashMaps(folder_.path()), clean);
  EXPECT_TRUE(fs::exists(folder_ / "stereo/phimvs.json"));
  EXPECT_FALSE(fs::exists(folder_ / "stereo/phimvs.shards"));
}

// Shards of several divisions, one after the other at random, each doing what it can; half of them stopped on their way.
TEST_F(ShardPipelineTest, AnyShardsInAnyOrderStoppedAnywhereEndInTheMapsOfOneRun) {
  const std::vector<std::string> clean = CleanMaps();
  for (unsigned seed = 0; seed < 3; ++seed) {
    const TemporaryFolder folder;
    test_support::WriteNoiseWorkspace(folder.path(), {.num_images = kNumImages});
    std::mt19937 random(seed);
    int num_ok = 0, num_runs = 0;
    for (; num_ok < 12 && num_runs < 500; ++num_runs) {
      const int count = 2 + static_cast<int>(random() % 4);
      const int index = static_cast<int>(random() % static_cast<unsigned>(count));
      options_.compact_maps = random() % 2 == 0;  // another form is no other map
      int calls_left = random() % 2 == 0 ? static_cast<int>(random() % 5) : 1000;
      calls_.on_call = [&](const std::string&, const std::string&) {
        if (calls_left-- == 0) throw std::runtime_error("killed");
      };
      try {
        const phi::ExitCode code =
            Run(folder.path(), {.index = index, .count = count, .only_stage = ""}).Code();
        EXPECT_TRUE(code == phi::ExitCode::kOk || code == kRetryLater);
        num_ok += code == phi::ExitCode::kOk;
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "killed");
      }
    }
    calls_.on_call = nullptr;
    options_.compact_maps = false;
    EXPECT_LT(num_runs, 500) << "shards wait for ever";
    Run(folder.path());
    EXPECT_EQ(HashMaps(folder.path()), clean) << "seed " << seed;
  }
}

TEST_F(ShardPipelineTest, SaysForWhichMapItWaits) {
  const test_support::LogCapture log;
  const RunSummary summary = Run(folder_.path(), {.index = 1, .count = 3, .only_stage = {}});
  EXPECT_EQ(summary.Code(), kRetryLater);
  EXPECT_EQ(summary.NumMade(), 0) << "both images wait";
  EXPECT_EQ(calls_.estimates, 2);
  EXPECT_EQ(calls_.filters, 0);
  EXPECT_THAT(
      log.messages(),
      ::testing::Contains(HasSubstr(
          "shared maps of 2 images wait for photometric maps that other shards have not made yet: " +
          names_[2] + " for that of ")));
}

// The image's failure is known, and the others do without its maps, as in one run.
TEST_F(ShardPipelineTest, AnImageThatFailedIsNotWaitedFor) {
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "estimate" && image == names_[0]) throw phi::InputError("image " + image + ": damaged");
  };
  const std::vector<std::string> clean = [&] {
    const TemporaryFolder whole;
    test_support::WriteNoiseWorkspace(whole.path(), {.num_images = kNumImages});
    EXPECT_EQ(Run(whole.path()).Code(), phi::ExitCode::kSomeImagesFailed);
    return HashMaps(whole.path());
  }();
  EXPECT_EQ(RunShard(0, 2, "photometric"), phi::ExitCode::kSomeImagesFailed);
  for (const char* stage : {"photometric", "shared", "measured", "inferred", "geometric"}) {
    EXPECT_EQ(RunShard(1, 2, stage), phi::ExitCode::kOk) << stage;
    if (stage == std::string("photometric")) continue;
    EXPECT_EQ(RunShard(0, 2, stage), phi::ExitCode::kOk) << stage;
  }
  EXPECT_THAT(SummaryLine(Run(folder_.path(), {.index = 0, .count = 2, .only_stage = "geometric"})),
              HasSubstr("2 of them kept from before, 1 failed in earlier stages"));
  const RunStatus status = FindStatus(RunRecord(folder_ / "stereo"));
  ASSERT_EQ(status.failures.size(), 1u);
  EXPECT_EQ(status.failures[0].image, names_[0]);
  EXPECT_EQ(status.stages.back().num_done, kNumImages - 1);
  EXPECT_EQ(status.stages.back().num_failed, 1);
  EXPECT_EQ(Run(folder_.path()).Code(), phi::ExitCode::kSomeImagesFailed);
  EXPECT_EQ(HashMaps(folder_.path()), clean);
}

TEST_F(ShardPipelineTest, MapsOfAnotherProgramAreNotReplaced) {
  for (const int shard : {0, 1}) RunShard(shard, 2, "photometric");
  const fs::path path = folder_ / "stereo/depth_maps" / (names_[0] + ".photometric.bin");
  WriteDepthMap(path, phi::DepthMap(24, 16, 5.0f));
  const auto run = [&](const Shard& shard) { return InputErrorOf([&] { Run(folder_.path(), shard); }); };
  EXPECT_THAT(run({.index = 0, .count = 2, .only_stage = ""}),
              HasSubstr(path.string() + " was not made by phimvs"));
  EXPECT_THAT(run({}), HasSubstr(path.string() + " was not made by phimvs"));
  EXPECT_EQ(RunShard(1, 2), kRetryLater) << "it waits for a map that is no longer ours";
}

// A network file system may show a map before the record of the shard that made it.
TEST_F(ShardPipelineTest, MapsWhoseRecordIsNotSeenYetAreLeftAlone) {
  for (const char* stage : {"photometric", "shared", "measured", "inferred", "geometric"}) {
    for (const int shard : {0, 1}) RunShard(shard, 2, stage);
  }
  const std::vector<std::string> maps = HashMaps(folder_.path());
  const TemporaryFolder hidden;
  const auto move_records_of_one = [](const fs::path& from, const fs::path& to) {
    for (const auto& entry : fs::directory_iterator(from)) {
      const std::string name = entry.path().filename();
      if (name.starts_with("1-of-2.")) fs::rename(entry.path(), to / name);
    }
  };
  const fs::path records = folder_ / "stereo/phimvs.shards";
  move_records_of_one(records, hidden.path());
  EXPECT_THAT(InputErrorOf([&] { Run(folder_.path()); }), HasSubstr("run the command again later"));
  EXPECT_EQ(HashMaps(folder_.path()), maps);
  move_records_of_one(hidden.path(), records);
  EXPECT_EQ(Run(folder_.path()).num_images_kept, kNumImages);
}

// Options change between two runs in shards, and nobody has run without shards meanwhile.
TEST_F(ShardPipelineTest, ShardsWithOtherOptionsMakeTheirMapsAnew) {
  const auto run_all = [&] {
    for (const char* stage : {"photometric", "shared", "measured", "inferred", "geometric"}) {
      for (const int shard : {0, 1}) EXPECT_EQ(RunShard(shard, 2, stage), phi::ExitCode::kOk) << stage;
    }
  };
  run_all();
  options_.stereo.seed = 5;
  calls_.estimates = 0;
  run_all();
  EXPECT_EQ(calls_.estimates, kNumImages);
  run_all();
  EXPECT_EQ(calls_.estimates, kNumImages) << "they are done";
  Run(folder_.path());
  EXPECT_EQ(calls_.estimates, kNumImages);
  EXPECT_EQ(HashMaps(folder_.path()), CleanMaps());
}

TEST_F(ShardPipelineTest, WithoutAnyPhotoAShardEndsWithAnErrorAndIsNotAtWork) {
  fs::remove_all(folder_ / "images");
  EXPECT_THAT(InputErrorOf([&] { RunShard(0, 2); }), HasSubstr("no image can be done: image " + names_[0]));
  const RunStatus status = FindStatus(RunRecord(folder_ / "stereo"));
  EXPECT_TRUE(status.open_shards.empty());
  EXPECT_EQ(status.failures.size(), 3u);
}

TEST_F(ShardPipelineTest, MapsOfEarlierOptionsAreNamedWhereOnlyShardsHaveRun) {
  for (const char* stage : {"photometric", "shared", "measured", "inferred", "geometric"}) {
    for (const int shard : {0, 1}) RunShard(shard, 2, stage);
  }
  const auto described = [&] { return DescribeStaleMaps(Workspace({.path = folder_.path()}), kGeometric); };
  EXPECT_THAT(described(), ::testing::IsEmpty());
  options_.geom_consistency = false;
  for (const char* stage : {"raw", "shared", "photometric"}) {
    for (const int shard : {0, 1}) RunShard(shard, 2, stage);
  }
  EXPECT_FALSE(fs::exists(folder_ / "stereo/phimvs.json"));
  EXPECT_THAT(described(), ::testing::ElementsAre(HasSubstr("6 of 6 geometric maps, " + names_[0] +
                                                            " the first, were made with other options")));
}

// Its shard never comes to the later stages, which note nothing; its measured map is older too, its estimates are not there.
TEST_F(ShardPipelineTest, MapsOfAnImageThatFailedSinceAreNamed) {
  const auto run_all = [&] {
    for (const char* stage : {"photometric", "shared", "measured", "inferred", "geometric"}) {
      for (const int shard : {0, 1}) RunShard(shard, 2, stage);
    }
  };
  const auto described = [&](std::string_view kind) { return DescribeStaleMaps(Workspace({.path = folder_.path()}), kind); };
  run_all();
  test_support::WriteBytes(folder_ / "images" / names_[0], test_support::ReadBytes(folder_ / "images" / names_[1]));
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "estimate" && image == names_[0]) throw phi::InputError("image " + image + ": damaged");
  };
  run_all();
  for (const std::string_view kind : {kMeasured, kGeometric}) {
    EXPECT_THAT(described(kind), ::testing::ElementsAre(HasSubstr("1 of 6 " + std::string(kind) + " maps, " + names_[0] +
                                                                  " the first, are of an earlier run, since their images failed")));
  }
  // What fails after a map says nothing of it.
  fs::remove_all(folder_ / "stereo");
  test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = kNumImages});
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "filter" && image == names_[0]) throw phi::InputError("image " + image + ": no luck");
  };
  run_all();
  EXPECT_THAT(described(kPhotometric), ::testing::IsEmpty());
  // Nor does what failed with other options.
  options_.geom_consistency = false;
  calls_.on_call = [&](const std::string& stage, const std::string& image) {
    if (stage == "estimate" && image == names_[0]) throw phi::InputError("image " + image + ": damaged");
  };
  for (const int shard : {0, 1}) RunShard(shard, 2, "raw");
  options_.geom_consistency = true;
  calls_.on_call = nullptr;
  options_.filter.min_num_consistent = 2;  // so that the filter that failed is tried again
  run_all();
  EXPECT_THAT(described(kGeometric), ::testing::IsEmpty());
}

// A shard notes what fails on the way to a map, also where a run without shards has no file of it.
TEST_F(ShardPipelineTest, MapsThatALaterStageCouldNotMakeAgainAreNamed) {
  const auto run_all = [&] {
    for (const char* stage : {"photometric", "shared", "measured", "inferred", "geometric"}) {
      for (const int shard : {0, 1}) RunShard(shard, 2, stage);
    }
  };
  for (const char* failing : {"share", "infer"}) {
    fs::remove_all(folder_ / "stereo");
    test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = kNumImages});
    calls_.on_call = nullptr;
    run_all();
    calls_.on_call = [&](const std::string& stage, const std::string& image) {
      if (stage == failing && image == names_[0]) throw phi::InputError("image " + image + ": damaged");
    };
    ++options_.stereo.seed;
    run_all();
    EXPECT_THAT(DescribeStaleMaps(Workspace({.path = folder_.path()}), kGeometric),
                ::testing::ElementsAre(HasSubstr("1 of 6 geometric maps, " + names_[0] +
                                                 " the first, are of an earlier run, since their images failed")))
        << failing;
  }
}

TEST_F(ShardPipelineTest, StatusCountsWhatIsLeft) {
  RunShard(0, 3, "photometric");
  const RunStatus status = FindStatus(RunRecord(folder_ / "stereo"));
  EXPECT_EQ(status.num_images, kNumImages);
  ASSERT_EQ(status.stages.size(), 5u);
  EXPECT_EQ(status.stages[0].name, "photometric");
  EXPECT_EQ(status.stages[0].num_done, 2);
  EXPECT_EQ(status.stages[0].num_waiting, 4);
  EXPECT_EQ(status.stages[4].num_waiting, 6);
  EXPECT_TRUE(status.open_shards.empty());
  EXPECT_LT(status.seconds_left, 0) << "nobody is at work";
}

}  // namespace
}  // namespace colmap_ext
