#include "colmap_ext/pipeline/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

TEST(ProgressEstimatorTest, KnowsNothingAtFirst) {
  ProgressEstimator estimator({1, 0.5});
  estimator.SetNumTasks(0, 10);
  estimator.SetNumTasks(1, 10);
  EXPECT_LT(estimator.SecondsLeft(), 0);
  EXPECT_EQ(estimator.Fraction(), 0);
}

TEST(ProgressEstimatorTest, CountsLaterStagesByTheirWeight) {
  ProgressEstimator estimator({1, 0.5});
  estimator.SetNumTasks(0, 10);
  estimator.SetNumTasks(1, 10);
  estimator.SetDone(0, 4, 8);  // 2 s a task: 6 more, and ten of 1 s
  EXPECT_DOUBLE_EQ(estimator.SecondsLeft(), 6 * 2 + 10 * 1);
  EXPECT_DOUBLE_EQ(estimator.Fraction(), 8.0 / (8 + 22));
}

TEST(ProgressEstimatorTest, MeasuredSpeedReplacesTheWeight) {
  ProgressEstimator estimator({1, 0.5});
  estimator.SetNumTasks(0, 10);
  estimator.SetNumTasks(1, 10);
  estimator.SetDone(0, 10, 20);
  estimator.SetDone(1, 5, 1);
  EXPECT_DOUBLE_EQ(estimator.SecondsLeft(), 5 * 0.2);
}

TEST(ProgressEstimatorTest, NothingToDoIsDone) { EXPECT_EQ(ProgressEstimator({1, 1}).Fraction(), 1); }

TEST(ProgressLineTest, LogsALineAtATimeWhereThereIsNoTerminal) {
  if (isatty(STDERR_FILENO)) GTEST_SKIP() << "stderr is a terminal";
  std::mutex mutex;
  std::vector<std::string> lines;
  phi::SetLogSink([&](phi::LogLevel, const std::string& line) {
    std::lock_guard<std::mutex> lock(mutex);
    lines.push_back(line);
  });
  {
    ProgressLine progress({"photometric"}, {1}, std::chrono::milliseconds(20));
    progress.SetNumTasks(0, 4);
    progress.BeginStage(0);
    progress.TaskDone();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  phi::SetLogSink(nullptr);
  ASSERT_FALSE(lines.empty());
  EXPECT_LE(lines.size(), 10u);
  EXPECT_THAT(lines.back(),
              ::testing::MatchesRegex("progress: [0-9]+ %, photometric 1 of 4 images, time left .*"));
}

TEST(FormatDurationTest, PicksTheUnit) {
  EXPECT_EQ(FormatDuration(7.4), "7 s");
  EXPECT_EQ(FormatDuration(200), "3 min 20 s");
  EXPECT_EQ(FormatDuration(7260), "2 h 1 min");
}

}  // namespace
}  // namespace colmap_ext
