// One progress line with the time left over the whole job: a bar that fits the terminal, else a line of log now and then.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace colmap_ext {

// Time left from the measured speed of each stage; stages that have not run yet count by their weight.
class ProgressEstimator {
 public:
  // weights: expected seconds of one task of each stage, in any common unit.
  explicit ProgressEstimator(const std::vector<double>& weights);

  void SetNumTasks(int stage, int num_tasks);
  // `seconds`: wall time that the stage has run so far; `num_done`: its tasks done in that time, with shares of those
  // under way.
  void SetDone(int stage, double num_done, double seconds);

  double Fraction() const;     // [0, 1]
  double SecondsLeft() const;  // < 0: unknown
 private:
  struct Stage {
    double weight = 1, seconds = 0, num_done = 0;
    int num_tasks = 0;
  };
  double SecondsPerWeight() const;  // <= 0: unknown
  double SecondsPerTask(const Stage& stage) const;

  std::vector<Stage> stages_;
};

// "3 min 20 s"
std::string FormatDuration(double seconds);

struct ProgressStage {
  std::string name;    // what is being done: "estimating"
  double weight = 1;   // expected seconds of one task, in the unit of all stages
  std::string unit{"images"};
};

// What a progress line tells.
struct ProgressState {
  std::string stage, unit;  // empty stage: none has begun
  int num_done = 0, num_tasks = 0;
  double fraction = 0;       // of the whole job, [0, 1]
  double seconds = 0;        // since the job began
  double seconds_left = -1;  // < 0: unknown
};

// Takes the place of the printed progress of every ProgressLine made from now on; empty: printed again. Called from another
// thread four times a second, and once at the end.
using ProgressSink = std::function<void(const ProgressState&)>;
void SetProgressSink(ProgressSink sink);

// At most `columns` characters: a bar, and of the rest what fits, the least important last.
std::string FormatBar(const ProgressState& state, int columns);

// Prints from a thread of its own, at log level 2 and above. Log lines that appear meanwhile go above the bar.
// Thread-safe.
class ProgressLine {
 public:
  // line_interval: between lines where there is no terminal; grows in a long run.
  explicit ProgressLine(std::vector<ProgressStage> stages,
                        std::chrono::milliseconds line_interval = std::chrono::seconds(10));
  // Of one stage, which has begun.
  ProgressLine(const ProgressStage& stage, std::size_t num_tasks);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void SetNumTasks(int stage, int num_tasks);
  void BeginStage(int stage);

  // A task under way of the stage that has begun; done, well or not, when it goes out of scope.
  class Task {
   public:
    explicit Task(ProgressLine* line) : line_(line) {}
    ~Task() { line_->TaskDone(share_); }
    Task(const Task&) = delete;
    Task& operator=(const Task&) = delete;
    // Of its work that is done, [0, 1], never less than before; from one thread at a time.
    void SetShare(double share);

   private:
    ProgressLine* line_;
    double share_ = 0;
  };

 private:
  using Clock = std::chrono::steady_clock;

  void AddShare(double share);
  void TaskDone(double share_told);
  void Loop();
  ProgressState State() const;
  void DrawBar();
  void EraseBar() const;
  void UpdateEstimate();
  Clock::duration Interval() const;

  const ProgressSink sink_;  // empty: progress is printed
  const bool terminal_;
  const std::chrono::milliseconds line_interval_;
  const std::vector<ProgressStage> stages_;
  mutable std::mutex mutex_;
  std::condition_variable stopped_;
  ProgressEstimator estimator_;
  std::vector<int> num_tasks_;
  int stage_ = -1, num_done_ = 0;
  double shares_ = 0;  // of the tasks under way
  const Clock::time_point begin_ = Clock::now();
  Clock::time_point stage_begin_, estimated_at_;
  std::size_t bar_length_ = 0;  // characters on the terminal
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace colmap_ext
