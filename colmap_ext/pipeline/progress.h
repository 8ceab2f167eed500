// One progress line with the time left over the whole job: a bar on a terminal, else a line every 10 seconds.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace colmap_ext {

// Time left from the measured speed of each stage; stages that have not run yet count by their weight.
class ProgressEstimator {
 public:
  // weights: expected seconds of one task of each stage, in any common unit.
  explicit ProgressEstimator(std::vector<double> weights);

  void SetNumTasks(int stage, int num_tasks);
  // `seconds`: wall time that the stage has run so far; `num_done`: its tasks done in that time.
  void SetDone(int stage, int num_done, double seconds);

  double Fraction() const;     // [0, 1]
  double SecondsLeft() const;  // < 0: unknown
 private:
  struct Stage {
    double weight = 1, seconds = 0;
    int num_tasks = 0, num_done = 0;
  };
  double SecondsPerWeight() const;  // <= 0: unknown
  double SecondsPerTask(const Stage& stage) const;

  std::vector<Stage> stages_;
};

// "3 min 20 s"
std::string FormatDuration(double seconds);

// Prints from a thread of its own. Log lines that appear meanwhile go above the bar. Thread-safe.
class ProgressLine {
 public:
  ProgressLine(std::vector<std::string> stage_names, std::vector<double> weights,
               std::chrono::milliseconds line_interval = std::chrono::seconds(10));
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void SetNumTasks(int stage, int num_tasks);
  void BeginStage(int stage);
  void TaskDone();

 private:
  void Loop();
  std::string Text() const;
  void DrawBar();
  void UpdateStage();

  const bool terminal_;
  const std::chrono::milliseconds line_interval_;  // where there is no terminal
  const std::vector<std::string> names_;
  mutable std::mutex mutex_;
  std::condition_variable stopped_;
  ProgressEstimator estimator_;
  std::vector<int> num_tasks_;
  int stage_ = -1, num_done_ = 0;
  std::chrono::steady_clock::time_point stage_begin_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace colmap_ext
