#include "colmap_ext/pipeline/run_status.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/fake_backend.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/run_pipeline.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

RunStatus HalfDone() {
  RunStatus status;
  status.num_images = 2;
  status.stages = {{.name = "photometric", .num_done = 1, .num_waiting = 1}};
  status.seconds_left = 60;
  return status;
}

TEST(StatusText, SaysHowToGoOnWhereNobodyIsAtWork) {
  EXPECT_THAT(StatusText(HalfDone(), LockUse::kFree),
              AllOf(HasSubstr("no run is at work on this computer; the same command goes on"), Not(HasSubstr("time left"))));
  EXPECT_THAT(StatusText(HalfDone(), LockUse::kHeld),
              AllOf(HasSubstr("a run is at work on this computer"), HasSubstr("time left: about")));
  EXPECT_THAT(StatusText(HalfDone(), LockUse::kUnknown), HasSubstr("cannot be told"));
}

// Photometric maps of four images, two of them done in 10 s each, the second 5 s after the run began to work.
class TimeLeft : public ::testing::Test {
 protected:
  void SetUp() override {
    RunRecord record(folder_.path());
    record.SetOptions({}, "hash");
    record.Begin({{"a", "photometric"}, {"b", "photometric"}, {"c", "photometric"}, {"d", "photometric"}}, {"", "", "", ""});
    for (const char* image : {"a", "b"}) record.Finish({image, "photometric"}, {.state = "done", .key = "", .seconds = 10});
    SetTime("phimvs.json", 0);
    SetTime("phimvs.json.journal", 5);
  }

  void SetTime(const char* file, int seconds) const {
    std::filesystem::last_write_time(folder_ / file, begin_ + std::chrono::seconds(seconds));
  }
  std::string Text() const { return StatusText(FindStatus(RunRecord(folder_.path())), LockUse::kHeld); }

  const test_support::TemporaryFolder folder_;
  const std::filesystem::file_time_type begin_ = std::filesystem::file_time_type::clock::now();
};

TEST_F(TimeLeft, IsByThePaceOfTheRun) { EXPECT_THAT(Text(), HasSubstr("time left: about 5 s\n")); }

// As maps are noted by a run that goes on: what earlier ones took tells nothing of its pace.
TEST_F(TimeLeft, OfARunThatGoesOnIsByItsOwnMaps) {
  RunRecord(folder_.path()).Begin({{"c", "photometric"}, {"d", "photometric"}}, {"", ""});
  EXPECT_THAT(Text(), HasSubstr("time left: not known: the run has finished no map yet\n"));
  RunRecord(folder_.path()).Finish({"c", "photometric"}, {.state = "done", .key = "", .seconds = 10});
  SetTime("phimvs.json", 0);
  SetTime("phimvs.json.journal", 20);
  EXPECT_THAT(Text(), HasSubstr("time left: about 20 s\n"));
}

TEST_F(TimeLeft, IsALowerBoundWhileAStageHasNoMap) {
  RunRecord record(folder_.path());
  record.Begin({{"a", "measured"}, {"b", "measured"}}, {"", ""});
  record.Finish({"c", "photometric"}, {.state = "done", .key = "", .seconds = 10});
  SetTime("phimvs.json", 0);
  SetTime("phimvs.json.journal", 10);
  EXPECT_THAT(Text(), HasSubstr("time left: more than 10 s: no measured map is done yet\n"));
}

// After runs with several options.
class StatusOfRuns : public ::testing::Test {
 protected:
  void SetUp() override { names_ = test_support::WriteNoiseWorkspace(folder_.path(), {.num_images = kNumImages}); }

  RunSummary Run() {
    return test_support::RunPipeline({.path = folder_.path()}, options_, test_support::MakeFakeBackends(&calls_, 1, 1));
  }
  RunStatus Status() const { return FindStatus(RunRecord(folder_ / "stereo")); }

  static constexpr int kNumImages = 4;
  const test_support::TemporaryFolder folder_;
  std::vector<std::string> names_;
  PipelineOptions options_;
  test_support::FakeCalls calls_;
};

// Maps of its kind only, and of its images only, are what the same command would go on with.
TEST_F(StatusOfRuns, NothingOfEarlierOnesWaits) {
  Run();
  EXPECT_EQ(Status().stages.size(), 3u);
  options_.geom_consistency = false;
  Run();
  ASSERT_EQ(Status().stages.size(), 1u);
  EXPECT_EQ(Status().stages[0].num_done, kNumImages);
  options_.geom_consistency = true;
  options_.stereo.seed = 5;
  test_support::WriteBytes(folder_ / "stereo/patch-match.cfg", names_[0] + "\n__auto__, 20\n" + names_[1] + "\n__auto__, 20\n");
  Run();
  EXPECT_EQ(Status().num_images, 2);
  for (const StageStatus& stage : Status().stages) {
    EXPECT_EQ(stage.num_done, 2) << stage.name;
    EXPECT_EQ(stage.num_waiting, 0) << stage.name;
  }
}

TEST_F(StatusOfRuns, WhatIsKeptIsDoneFromTheBegin) {
  Run();
  options_.filter.min_num_consistent = 2;
  int num_asked = 0;
  calls_.on_filter = [&](const phi::FilterInput&) {
    ++num_asked;
    EXPECT_EQ(Status().stages[0].num_done, kNumImages);
  };
  calls_.estimates = 0;
  Run();
  EXPECT_GT(num_asked, 0);
  EXPECT_EQ(calls_.estimates, 0) << "photometric maps are kept";
}

// An image that failed before is tried first, and only then it is known what others keep that are made without it.
TEST_F(StatusOfRuns, WhatIsKeptWithoutAnImageThatFailsIsDone) {
  test_support::WriteBytes(folder_ / "images" / names_[1], "no image");
  Run();
  options_.inference.mode = phi::InferenceMode::kMinCost;
  calls_.filters = 0;
  Run();
  EXPECT_EQ(calls_.filters, kNumImages - 1) << "of geometric maps: measured ones are kept";
  ASSERT_EQ(Status().stages.size(), 3u);
  EXPECT_EQ(Status().stages[1].num_done, kNumImages - 1);
}

// One that was killed leaves its journal, which the next run without shards reads and cannot know to be nobody's.
TEST_F(StatusOfRuns, ShardsBeforeARunOfAllImagesAreNotAtWork) {
  {
    RunRecord record(folder_ / "stereo");
    record.SetOptions({}, "hash");
    record.BeginShard({.shard = "0/2", .num_images = kNumImages, .stages = {"photometric", "shared", "measured", "inferred", "geometric"}});
    record.Begin({{names_[0], "photometric"}}, {"key"});
  }
  EXPECT_EQ(Status().open_shards, std::vector<std::string>{"0/2"});
  EXPECT_EQ(Status().stages.size(), 5u);
  Run();
  EXPECT_TRUE(Status().open_shards.empty());
  ASSERT_EQ(Status().stages.size(), 3u);
  EXPECT_EQ(Status().stages[2].num_done, kNumImages);
  RunRecord again(folder_ / "stereo");
  again.BeginShard({.shard = "1/2", .num_images = kNumImages, .stages = {"photometric"}});
  again.Begin({{names_[0], "photometric"}}, {"key"});
  EXPECT_EQ(Status().open_shards, std::vector<std::string>{"1/2"});
}

// And its maps of other options are no other program's when it is there again.
TEST_F(StatusOfRuns, AnImageThatIsMissingHasFailed) {
  Run();
  const std::filesystem::path image = folder_ / "images" / names_[1], away = folder_ / "away.png";
  std::filesystem::rename(image, away);
  options_.stereo.seed = 5;
  Run();
  ASSERT_EQ(Status().failures.size(), 1u);
  EXPECT_EQ(Status().failures[0].image, names_[1]);
  EXPECT_EQ(Status().stages.back().num_failed, 1);
  EXPECT_EQ(Status().stages.back().num_waiting, 0);
  std::filesystem::rename(away, image);
  EXPECT_TRUE(Run().failures.empty());
  EXPECT_TRUE(Status().failures.empty());
}

// The lock of a shard is seen on its own computer alone.
TEST(StatusText, ShardsMayBeAtWorkElsewhere) {
  RunStatus status = HalfDone();
  status.open_shards = {"3/8"};
  EXPECT_THAT(StatusText(status, LockUse::kFree),
              AllOf(HasSubstr("shards at work on other computers, or killed and not started again: 3/8\n"),
                    HasSubstr("time left: about"), Not(HasSubstr("the same command"))));
  EXPECT_THAT(StatusText(status, LockUse::kHeld),
              AllOf(HasSubstr("shards at work, or killed and not started again: 3/8\n"), HasSubstr("a run is at work")));
}

TEST(WorkspaceLock, IsSeenWhileItIsHeld) {
  const test_support::TemporaryFolder folder;
  for (const auto sharing : {WorkspaceLock::Sharing::kAlone, WorkspaceLock::Sharing::kWithShards}) {
    EXPECT_EQ(FindLockUse(folder.path()), LockUse::kFree);
    const WorkspaceLock lock(folder.path(), sharing);
    EXPECT_EQ(FindLockUse(folder.path()), LockUse::kHeld);
  }
  EXPECT_EQ(FindLockUse(folder / "none"), LockUse::kUnknown);
}

// As of Python's multiprocessing, whose workers live on after the run.
TEST(WorkspaceLock, IsGivenUpThoughAForkedProcessHasItsFile) {
  const test_support::TemporaryFolder folder;
  pid_t worker = -1;
  {
    const WorkspaceLock lock(folder.path());
    worker = fork();
    if (worker == 0) {
      for (;;) pause();
    }
    EXPECT_EQ(FindLockUse(folder.path()), LockUse::kHeld);
  }
  EXPECT_EQ(FindLockUse(folder.path()), LockUse::kFree);
  kill(worker, SIGKILL);
  waitpid(worker, nullptr, 0);
}

// As FindLockUse of another process would, for a moment.
TEST(WorkspaceLock, WaitsForWhoOnlyLooks) {
  const test_support::TemporaryFolder folder;
  const int other = open(folder.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(flock(other, LOCK_EX), 0);
  std::thread looks([other] {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    close(other);
  });
  EXPECT_NO_THROW(WorkspaceLock{folder.path()});
  looks.join();
}

}  // namespace
}  // namespace colmap_ext
