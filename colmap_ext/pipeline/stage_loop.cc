#include "colmap_ext/pipeline/stage_loop.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <utility>

#include "colmap_ext/failure_text.h"
#include "colmap_ext/pipeline/task_queue.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// The pending tasks of a plan as one list, and how many of them still read each map.
class TaskList {
 public:
  struct Entry {
    int stage, job;
  };

  TaskList(const std::vector<Stage>& stages, const std::vector<ImageJob>& jobs,
           const std::vector<StagePlan>& plan, int end_stage)
      : stages_(stages), jobs_(jobs) {
    std::vector<int> previous, own;  // by job: the task that makes the map, -1: none does
    for (int s = 0; s < end_stage; ++s) {
      previous = std::exchange(own, std::vector<int>(jobs.size(), -1));
      for (const int job : plan[s].pending) {
        own[job] = static_cast<int>(entries_.size());
        queued_.push_back({.kind = s, .needs = {}});
        entries_.push_back({s, job});
        for (const MapRead& read : Reads(entries_.back())) {
          ++num_readers_[read];
          const auto& [stage, input] = read;
          if (stage == s - 1 && previous[input] >= 0) queued_.back().needs.push_back(previous[input]);
        }
      }
    }
  }

  const std::vector<QueuedTask>& queued() const { return queued_; }
  const std::vector<Entry>& entries() const { return entries_; }

  // A stage, and the job whose map of it is read.
  using MapRead = std::pair<int, int>;

  // What no task reads any more, now that this one has ended.
  std::vector<MapRead> EndReading(int task) {
    std::vector<MapRead> unread;
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const MapRead& read : Reads(entries_[task])) {
      if (--num_readers_[read] == 0) unread.push_back(read);
    }
    return unread;
  }

 private:
  // The first stage reads no maps. The measured ones that a stage restores are there: inference read them.
  std::vector<MapRead> Reads(const Entry& entry) const {
    std::vector<MapRead> reads;
    if (entry.stage == 0) return reads;
    for (const int input : InputJobs(stages_[entry.stage], jobs_, entry.job)) reads.emplace_back(entry.stage - 1, input);
    if (stages_[entry.stage].restores_measured) reads.emplace_back(entry.stage - 2, entry.job);
    return reads;
  }

  const std::vector<Stage>& stages_;
  const std::vector<ImageJob>& jobs_;
  std::vector<QueuedTask> queued_;
  std::vector<Entry> entries_;
  std::mutex mutex_;                     // guards num_readers_ while tasks run
  std::map<MapRead, int> num_readers_;
};

// Enough to keep up with several devices, few enough that what waits to be written stays small.
int NumWriters(const Backends& backends) { return std::clamp(NumAtOnce(backends), 2, 8); }

}  // namespace

StageLoop::StageLoop(const Workspace& workspace, const std::vector<ImageJob>& jobs,
                     const PipelineOptions& options, SparseDepthFunction sparse_depth,
                     const Backends& backends, std::int64_t cache_bytes)
    : workspace_(workspace),
      jobs_(jobs),
      backends_(backends),
      store_(workspace, cache_bytes, NumWriters(backends)),
      tasks_(workspace, jobs, options, std::move(sparse_depth), &store_) {}

void StageLoop::Begin(std::vector<Stage> stages) {
  stages_ = std::move(stages);
  states_.assign(stages_.size(), std::vector<State>(jobs_.size(), State::kOpen));
  std::vector<ProgressStage> progress_stages;
  for (const Stage& stage : stages_) {
    progress_stages.push_back({.name = ActivityName(stage.kind), .weight = stage.weight});
  }
  progress_ = std::make_unique<ProgressLine>(std::move(progress_stages));
}

std::vector<StagePlan> StageLoop::Plan(const PlanQueries& earlier, const PlanScope& scope) const {
  return MakePlan(stages_, jobs_,
                  {.is_done =
                       [&](int stage, int job, const std::string& key) {
                         return states_[stage][job] == State::kMade || earlier.is_done(stage, job, key);
                       },
                   .has_failed =
                       [&](int stage, int job, const std::string& key) {
                         return states_[stage][job] == State::kFailed || earlier.has_failed(stage, job, key);
                       }},
                  scope);
}

void StageLoop::Run(const std::vector<StagePlan>& plan, int end_stage, const KeepFunction& keep, const FailFunction& fail) {
  TellNumTasks(plan);
  TaskList tasks(stages_, jobs_, plan, end_stage);
  const auto forget = [&](int task) {
    for (const auto& [stage, job] : tasks.EndReading(task)) {
      store_.Forget(jobs_[job].image, stages_[stage].result);
      if (stages_[stage + 1].kind == StageKind::kInfer) store_.ForgetRegions(jobs_[job].image);
    }
  };
  const auto tell = [&](int task, const phi::Message& message, bool is_too_large) {
    const auto [stage, job] = tasks.entries()[task];
    NoteFailedFile(message.file);
    fail({stage, job, message, is_too_large});
  };
  const QueueOutcome queue = RunTasks(tasks.queued(), backends_, [&](int task, phi::Backend& backend) {
    const auto [stage, job] = tasks.entries()[task];
    try {
      RunTask(plan, stage, job, backend, keep);
    } catch (const phi::InputError& error) {  // told at once: a run may go on for days, or be killed
      tell(task, error.message(), false);
      throw;
    }
    forget(task);
  });
  const auto set_state = [&](int task, State state) {
    states_[tasks.entries()[task].stage][tasks.entries()[task].job] = state;
  };
  for (int task = 0; task < static_cast<int>(tasks.entries().size()); ++task) set_state(task, State::kMade);
  for (const int task : queue.left_out) set_state(task, State::kOpen);
  for (const TaskFailure& failure : queue.failures) {
    set_state(failure.task, State::kFailed);
    forget(failure.task);
    if (failure.is_too_large) tell(failure.task, failure.message, true);
  }
}

void StageLoop::TellNumTasks(const std::vector<StagePlan>& plan) {
  for (std::size_t s = 0; s < plan.size(); ++s) {
    const auto num_open = std::count(states_[s].begin(), states_[s].end(), State::kOpen);
    const std::size_t num_ended = jobs_.size() - static_cast<std::size_t>(num_open);
    progress_->SetNumTasks(static_cast<int>(s), static_cast<int>(plan[s].pending.size() + num_ended));
  }
}

bool StageLoop::InferenceFollows(const std::vector<StagePlan>& plan, int job) const {
  for (std::size_t s = 0; s < plan.size(); ++s) {
    if (stages_[s].kind == StageKind::kInfer)
      return std::binary_search(plan[s].pending.begin(), plan[s].pending.end(), job);
  }
  return false;
}

void StageLoop::PrepareInference(const std::vector<StagePlan>& plan, int stage, int job, const phi::Backend& backend,
                                 ThreadGroup* beside) const {
  const bool host_is_idle = stages_[stage].kind == StageKind::kEstimate && backend.NumConcurrentImages() > 1;
  if (!host_is_idle || !InferenceFollows(plan, job)) return;
  beside->StartIfPossible([this, job] { tasks_.PrepareInference(job); });
}

void StageLoop::RunTask(const std::vector<StagePlan>& plan, int stage, int job, phi::Backend& backend,
                        const KeepFunction& keep) {
  using Clock = std::chrono::steady_clock;
  static const std::vector<std::string> kNoKeys;
  const Clock::time_point begin = Clock::now();
  ProgressLine::Task progress(progress_.get(), stage);
  ThreadGroup beside;
  PrepareInference(plan, stage, job, backend, &beside);
  const StageTask task = {.stage = stages_[stage],
                          .previous = stage > 0 ? &stages_[stage - 1] : nullptr,
                          .input_keys = stage > 0 ? plan[stage - 1].keys : kNoKeys,
                          .job = jobs_[job]};
  TaskOutcome outcome;
  outcome.result = tasks_.Run(task, backend, &progress, &outcome.unread_sources);
  NoteUnreadSources(jobs_[job].image, outcome.unread_sources);
  outcome.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  keep(stage, job, std::move(outcome));
}

void StageLoop::NoteUnreadSources(int image, const std::vector<phi::Message>& unread) {
  for (const phi::Message& message : unread) {
    phi::LogDebug("image " + phi::AboutImage(workspace_.views()[image].name) + ": " + kSourceLeftOut + message);
    const std::lock_guard<std::mutex> lock(told_mutex_);
    unread_sources_.emplace(message.text, message);
  }
}

void StageLoop::NoteFailedFile(const std::string& file) {
  const std::lock_guard<std::mutex> lock(told_mutex_);
  if (!file.empty()) failed_files_.insert(file);
}

void StageLoop::WarnOfUnreadSources() {
  for (const ImageJob& job : jobs_) NoteFailedFile(job.problem.file);
  std::vector<phi::Message> untold;
  for (const auto& [text, message] : unread_sources_) {
    if (!failed_files_.contains(message.file)) untold.push_back(message);
  }
  if (!untold.empty()) phi::LogWarning(ListByReason("source images were left out, since they cannot be read:", untold));
}

void StageLoop::End() {
  store_.Drain();
  progress_.reset();
  WarnOfUnreadSources();
}

}  // namespace colmap_ext
