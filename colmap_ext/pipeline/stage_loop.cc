#include "colmap_ext/pipeline/stage_loop.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <utility>

#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// The tasks of several stages as one list, and how many of them still read each map.
class TaskList {
 public:
  struct Entry {
    const StageWork* work;
    int job;
  };

  TaskList(const std::vector<StageWork>& works, const std::vector<ImageJob>& jobs) : jobs_(jobs) {
    std::vector<int> previous, own;  // by job: the task that makes the map, -1: none does
    for (const StageWork& work : works) {
      previous = std::move(own);
      own.assign(jobs.size(), -1);
      for (const int job : work.pending) {
        own[job] = static_cast<int>(entries_.size());
        queued_.push_back({.kind = work.number, .needs = {}});
        entries_.push_back({&work, job});
        if (work.previous == nullptr) continue;
        for (const int input : InputJobs(work.stage, jobs, job)) {
          ++num_readers_[{work.number, input}];
          if (!previous.empty() && previous[input] >= 0) queued_.back().needs.push_back(previous[input]);
        }
      }
    }
  }

  const std::vector<QueuedTask>& queued() const { return queued_; }
  const Entry& operator[](int task) const { return entries_[task]; }

  // The jobs whose maps of the stage before no task reads any more, now that this one has ended.
  std::vector<int> EndReading(int task) {
    const Entry& entry = entries_[task];
    std::vector<int> unread;
    if (entry.work->previous == nullptr) return unread;
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const int input : InputJobs(entry.work->stage, jobs_, entry.job)) {
      if (--num_readers_[{entry.work->number, input}] == 0) unread.push_back(input);
    }
    return unread;
  }

 private:
  const std::vector<ImageJob>& jobs_;
  std::vector<QueuedTask> queued_;
  std::vector<Entry> entries_;
  std::mutex mutex_;                                // guards num_readers_ while tasks run
  std::map<std::pair<int, int>, int> num_readers_;  // by the stage that reads, and the job that it reads of
};

// Enough to keep up with several devices, few enough that what waits to be written stays small.
int NumWriters(const Backends& backends) {
  int num_at_once = 0;
  for (const auto& backend : backends) num_at_once += std::max(1, backend->NumConcurrentImages());
  return std::clamp(num_at_once, 2, 8);
}

}  // namespace

StageLoop::StageLoop(const Workspace& workspace, const std::vector<ImageJob>& jobs,
                     const PipelineOptions& options, SparseDepthFunction sparse_depth,
                     const Backends& backends, std::int64_t cache_bytes)
    : workspace_(workspace),
      jobs_(jobs),
      backends_(backends),
      store_(workspace, cache_bytes, NumWriters(backends)),
      tasks_(workspace, jobs, options, std::move(sparse_depth), &store_) {}

void StageLoop::Begin(const std::vector<Stage>& stages) {
  std::vector<ProgressStage> progress_stages;
  for (const Stage& stage : stages) {
    progress_stages.push_back({.name = ActivityName(stage.kind), .weight = stage.weight});
  }
  progress_ = std::make_unique<ProgressLine>(std::move(progress_stages));
}

LoopOutcome StageLoop::Run(const std::vector<StageWork>& works, const KeepFunction& keep) {
  TaskList tasks(works, jobs_);
  const auto forget = [&](int task) {
    const TaskList::Entry& entry = tasks[task];
    for (const int input : tasks.EndReading(task))
      store_.Forget(jobs_[input].image, entry.work->previous->result);
  };
  const QueueOutcome queue = RunTasks(tasks.queued(), backends_, [&](int task, phi::Backend& backend) {
    RunTask(*tasks[task].work, tasks[task].job, backend, keep);
    forget(task);
  });
  LoopOutcome outcome;
  for (const TaskFailure& failure : queue.failures) {
    outcome.failures.push_back({tasks[failure.task].work->number, tasks[failure.task].job, failure.message});
    forget(failure.task);
  }
  for (const int task : queue.left_out)
    outcome.left_out.emplace_back(tasks[task].work->number, tasks[task].job);
  return outcome;
}

void StageLoop::RunTask(const StageWork& work, int job, phi::Backend& backend, const KeepFunction& keep) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  ProgressLine::Task progress(progress_.get(), work.number);
  TaskOutcome outcome;
  outcome.result =
      tasks_.Run(work.stage, work.previous, work.input_keys, job, backend, &progress, &outcome.warnings);
  const std::string& name = workspace_.views()[jobs_[job].image].name;
  for (const std::string& warning : outcome.warnings) phi::LogWarning("image " + name + ": " + warning);
  outcome.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  keep(work, job, std::move(outcome));
}

void StageLoop::End() {
  store_.Drain();
  progress_.reset();
}

}  // namespace colmap_ext
