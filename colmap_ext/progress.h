// One progress line with the time left over the whole job: a bar that fits the terminal, else a line of log now and then.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace colmap_ext {

// Time left from what a task of each stage took, and how many ran side by side; stages of which none has ended count by their
// weight.
class ProgressEstimator {
 public:
  // weights: expected seconds of one task of each stage, in any common unit.
  explicit ProgressEstimator(const std::vector<double>& weights);

  void SetNumTasks(int stage, int num_tasks);
  // `num_done`: tasks of the stage, with shares of those under way; `seconds`: of these tasks, one after the other.
  void SetDone(int stage, double num_done, double seconds);
  // Wall time since the first task began, in which tasks ran side by side.
  void SetElapsed(double seconds) { elapsed_ = seconds; }

  double Fraction() const;     // [0, 1]
  double SecondsLeft() const;  // < 0: unknown
 private:
  struct Stage {
    double weight = 1, seconds = 0, num_done = 0;
    int num_tasks = 0;
  };
  double SecondsPerWeight() const;  // <= 0: unknown
  double SecondsPerTask(const Stage& stage) const;
  double SecondsSpent() const;  // of all tasks, one after the other
  double TaskSecondsLeft() const;

  std::vector<Stage> stages_;
  double elapsed_ = 0;
};

// "3 min 20 s"
std::string FormatDuration(double seconds);

struct ProgressStage {
  std::string name;   // what is being done: "estimating"
  double weight = 1;  // expected seconds of one task, in the unit of all stages
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

  // A task of a stage under way; done, well or not, when it goes out of scope.
  class Task {
   public:
    explicit Task(ProgressLine* line, int stage = 0);
    ~Task();
    Task(const Task&) = delete;
    Task& operator=(const Task&) = delete;
    // Of its work that is done, [0, 1], never less than before; from one thread at a time.
    void SetShare(double share);

   private:
    friend class ProgressLine;

    ProgressLine* line_;
    const int stage_;
    const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
    double share_ = 0;  // guarded by the line's mutex
  };

 private:
  using Clock = std::chrono::steady_clock;

  struct Counts {
    int num_tasks = 0, num_done = 0;
    double seconds = 0;  // of the tasks done, one after the other
  };

  void Loop();
  ProgressState State() const;
  // The first stage with work left, else the last one.
  std::size_t ShownStage() const;
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
  std::vector<Counts> counts_;     // by stage
  std::set<const Task*> running_;  // tasks under way
  const Clock::time_point begin_ = Clock::now();
  std::optional<Clock::time_point> first_begin_;  // of a task; empty: none has begun
  Clock::time_point estimated_at_;
  std::size_t bar_length_ = 0;  // characters on the terminal
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace colmap_ext
