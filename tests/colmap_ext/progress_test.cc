#include "colmap_ext/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// A task of the second stage is expected to take half as long.
ProgressEstimator TwoStagesOfTen() {
  ProgressEstimator estimator({1, 0.5});
  for (int stage = 0; stage < 2; ++stage) estimator.SetNumTasks(stage, 10);
  return estimator;
}

TEST(ProgressEstimatorTest, KnowsNothingAtFirst) {
  ProgressEstimator estimator = TwoStagesOfTen();
  EXPECT_LT(estimator.SecondsLeft(), 0);
  EXPECT_EQ(estimator.Fraction(), 0);
}

TEST(ProgressEstimatorTest, CountsLaterStagesByTheirWeight) {
  ProgressEstimator estimator = TwoStagesOfTen();
  estimator.SetDone(0, 4, 8);  // 2 s a task: 6 more, and ten of 1 s
  estimator.SetElapsed(8);
  EXPECT_DOUBLE_EQ(estimator.SecondsLeft(), 6 * 2 + 10 * 1);
  EXPECT_DOUBLE_EQ(estimator.Fraction(), 8.0 / (8 + 22));
}

TEST(ProgressEstimatorTest, MeasuredSpeedReplacesTheWeight) {
  ProgressEstimator estimator = TwoStagesOfTen();
  estimator.SetDone(0, 10, 20);
  estimator.SetDone(1, 5, 1);
  estimator.SetElapsed(21);
  EXPECT_DOUBLE_EQ(estimator.SecondsLeft(), 5 * 0.2);
}

TEST(ProgressEstimatorTest, AQuarterOfTheFirstTaskTellsTheTimeOfAll) {
  ProgressEstimator estimator({1});
  estimator.SetNumTasks(0, 3);
  estimator.SetDone(0, 0.25, 5);
  estimator.SetElapsed(5);
  EXPECT_DOUBLE_EQ(estimator.SecondsLeft(), 2.75 * 20);
}

TEST(ProgressEstimatorTest, TasksSideBySideTakeTheirShareOfTheTime) {
  ProgressEstimator estimator = TwoStagesOfTen();
  estimator.SetDone(0, 4, 8);
  estimator.SetDone(1, 2, 2);
  estimator.SetElapsed(5);  // 10 s of tasks in it: two at a time
  EXPECT_DOUBLE_EQ(estimator.SecondsLeft(), (6 * 2 + 8 * 1) / 2.0);
  EXPECT_DOUBLE_EQ(estimator.Fraction(), 10.0 / (10 + 20));
}

TEST(ProgressEstimatorTest, NothingToDoIsDone) { EXPECT_EQ(ProgressEstimator({1, 1}).Fraction(), 1); }

TEST(FormatBarTest, FitsEveryTerminal) {
  const ProgressState state = {"estimating", "images", 12345, 67890, 0.5, 12345, 98765};
  for (int columns = 1; columns <= 200; ++columns) {
    EXPECT_LE(FormatBar(state, columns).size(), static_cast<std::size_t>(columns));
  }
}

TEST(FormatBarTest, ShowsWhatThereIsRoomFor) {
  const ProgressState state = {"estimating", "images", 3, 19, 0.25, 65, 200};
  EXPECT_EQ(FormatBar(state, 79),
            "[#######.......................] 25 %, estimating 3/19, 3:20 left, 1:05 so far");
  EXPECT_EQ(FormatBar(state, 40), "25 %, estimating 3/19, 3:20 left");
  EXPECT_EQ(FormatBar(state, 12), "25 %");
}

std::vector<std::string> LinesOf(const std::function<void()>& run) {
  std::mutex mutex;
  std::vector<std::string> lines;
  phi::SetLogSink([&](phi::LogLevel, const std::string& line) {
    std::lock_guard<std::mutex> lock(mutex);
    lines.push_back(line);
  });
  run();
  phi::SetLogSink(nullptr);
  return lines;
}

TEST(ProgressLineTest, LogsALineAtATimeWhereThereIsNoTerminal) {
  if (isatty(STDERR_FILENO)) GTEST_SKIP() << "stderr is a terminal";
  const std::vector<std::string> lines = LinesOf([] {
    ProgressLine progress(std::vector<ProgressStage>{{.name = "estimating"}}, std::chrono::milliseconds(20));
    progress.SetNumTasks(0, 4);
    { const ProgressLine::Task task(&progress); }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  });
  ASSERT_FALSE(lines.empty());
  EXPECT_LE(lines.size(), 10u);
  EXPECT_THAT(lines.back(),
              ::testing::MatchesRegex("progress: [0-9]+ %, estimating 1 of 4 images, .* so far, .* left"));
}

TEST(ProgressLineTest, MovesWithinATask) {
  if (isatty(STDERR_FILENO)) GTEST_SKIP() << "stderr is a terminal";
  const std::vector<std::string> lines = LinesOf([] {
    ProgressLine progress(std::vector<ProgressStage>{{.name = "estimating"}}, std::chrono::milliseconds(20));
    progress.SetNumTasks(0, 1);
    ProgressLine::Task task(&progress);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    task.SetShare(0.5);
    task.SetShare(0.75);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  });
  ASSERT_FALSE(lines.empty());
  EXPECT_THAT(lines.back(), ::testing::StartsWith("progress: 75 %, estimating 0 of 1 images"));
}

TEST(ProgressLineTest, ShowsTheFirstStageThatHasWorkLeft) {
  if (isatty(STDERR_FILENO)) GTEST_SKIP() << "stderr is a terminal";
  const std::vector<std::string> lines = LinesOf([] {
    ProgressLine progress(std::vector<ProgressStage>{{.name = "estimating"}, {.name = "filtering"}, {.name = "writing"}},
                          std::chrono::milliseconds(20));
    for (int stage = 0; stage < 3; ++stage) progress.SetNumTasks(stage, 2);
    for (const int stage : {0, 1, 0, 2}) const ProgressLine::Task task(&progress, stage);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  });
  ASSERT_FALSE(lines.empty());
  EXPECT_THAT(lines.back(), ::testing::HasSubstr(", filtering 1 of 2 images, "));
}

TEST(FormatDurationTest, PicksTheUnit) {
  EXPECT_EQ(FormatDuration(7.4), "7 s");
  EXPECT_EQ(FormatDuration(200), "3 min 20 s");
  EXPECT_EQ(FormatDuration(7260), "2 h 1 min");
}

}  // namespace
}  // namespace colmap_ext
