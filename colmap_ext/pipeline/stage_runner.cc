#include "colmap_ext/pipeline/stage_runner.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "colmap_ext/pipeline/thread_group.h"
#include "phi/base/log.h"
#include "phi/base/utc_time.h"

namespace colmap_ext {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kHardlyAny = 0.01;  // of an image's pixels

}  // namespace

StageRunner::StageRunner(const Workspace& workspace, const std::vector<ImageJob>& jobs,
                         const PipelineOptions& options, SparseDepthFunction sparse_depth,
                         const Backends& backends)
    : workspace_(workspace),
      jobs_(jobs),
      backends_(backends),
      record_(workspace.StereoFolder()),
      loop_(workspace, jobs, options, std::move(sparse_depth), backends, options.CacheBytes()) {
  summary_.num_images = static_cast<int>(jobs.size());
}

const std::string& StageRunner::NameOf(int job) const { return workspace_.views()[jobs_[job].image].name; }

void StageRunner::Begin(std::vector<Stage> stages) {
  for (const Stage& stage : stages) summary_.stages.push_back({.name = stage.result});
  loop_.Begin(std::move(stages));
}

bool StageRunner::HasFailedBefore(int stage, const StagePlan& plan) const {
  return std::any_of(plan.pending.begin(), plan.pending.end(),
                     [&](int job) { return record_.Has(TaskOf(stage, job), "failed", plan.keys[job]); });
}

void StageRunner::Run(const std::vector<StagePlan>& plan) {
  int end_stage = 0;
  for (bool goes_on = true; goes_on && end_stage < static_cast<int>(plan.size()); ++end_stage) {
    goes_on = !HasFailedBefore(end_stage, plan[end_stage]);
  }
  for (int s = 0; s < end_stage; ++s) BeginTasks(s, plan[s]);
  spans_.assign(summary_.stages.size(), {});
  loop_.Run(
      plan, end_stage,
      [&](int stage, int job, const TaskOutcome& outcome) { Keep(stage, job, plan[stage].keys[job], outcome); },
      [&](const JobFailure& failure) { RecordFailure(failure, plan[failure.stage].keys[failure.job]); });
  for (std::size_t s = 0; s < spans_.size(); ++s) {
    const std::chrono::duration<double> span = spans_[s].end - spans_[s].begin;
    if (span.count() > 0) summary_.stages[s].seconds += span.count();
  }
}

void StageRunner::BeginTasks(int stage, const StagePlan& plan) {
  if (StageOf(stage).transient || plan.pending.empty()) return;
  std::vector<RunRecord::Task> tasks;
  std::vector<std::string> keys;
  for (const int job : plan.pending) {
    tasks.push_back(TaskOf(stage, job));
    keys.push_back(plan.keys[job]);
  }
  record_.Begin(tasks, keys);
}

void StageRunner::Keep(int stage, int job, const std::string& key, const TaskOutcome& outcome) {
  TaskRecord record;
  for (const phi::Message& message : outcome.unread_sources) record.warnings.push_back(kSourceLeftOut + message.text);
  record.state = "done";
  record.key = key;
  record.seconds = outcome.seconds;
  record.peak_memory_bytes = PeakHostBytes();
  Save(stage, job, outcome.result, record);
  Count(stage, job, outcome);
}

void StageRunner::Count(int stage, int job, const TaskOutcome& outcome) {
  const phi::MeasurementMap& map = *outcome.result.map;
  const std::int64_t num_with_depth = phi::CountPublished(map);
  const auto num_pixels = static_cast<std::int64_t>(map.size());
  const Clock::time_point now = Clock::now();
  const auto begin =
      now - std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(outcome.seconds));
  std::lock_guard<std::mutex> lock(mutex_);
  spans_[stage] = {std::min(spans_[stage].begin, begin), now};
  StageSummary& summary = summary_.stages[stage];
  ++summary.num_made;
  summary.num_pixels += num_pixels;
  summary.num_with_depth += num_with_depth;
  const bool is_last = stage + 1 == static_cast<int>(summary_.stages.size());
  if (is_last && static_cast<double>(num_with_depth) < kHardlyAny * static_cast<double>(num_pixels))
    nearly_empty_.insert(std::lower_bound(nearly_empty_.begin(), nearly_empty_.end(), job), job);
}

void StageRunner::Save(int stage, int job, const StageResult& result, const TaskRecord& record) {
  const std::string& kind = StageOf(stage).result;
  if (StageOf(stage).transient) {
    store().KeepTransient(jobs_[job].image, kind, result);
    return;
  }
  store().Write(
      jobs_[job].image, kind, result,
      [this, task = TaskOf(stage, job), record = record](const std::vector<FileIdentity>& files) mutable {
        record.files = files;
        record_.Finish(task, record);
      });
}

// What is not recorded has no place for it: what would have been made of it has failed.
void StageRunner::RecordFailure(const JobFailure& failure, const std::string& key) {
  Fail(failure.job, StageOf(failure.stage).result, failure.message, failure.is_too_large);
  int stage = failure.stage;
  while (StageOf(stage).transient) ++stage;
  TaskRecord record;
  record.state = "failed";
  record.key = stage == failure.stage ? key : "";
  record.warnings = {failure.message.text};
  record_.Finish(TaskOf(stage, failure.job), record);
}

void StageRunner::Fail(int job, const std::string& stage, const phi::Message& message, bool is_too_large) {
  const phi::Message failure = WithContext(message, phi::AboutImage(NameOf(job)) + phi::AboutStage(stage));
  phi::LogError(failure);
  std::lock_guard<std::mutex> lock(mutex_);
  summary_.failures.push_back(failure);
  summary_.num_too_large += is_too_large ? 1 : 0;
}

void StageRunner::LeaveOut(const phi::Message& why) {
  phi::LogWarning(why);
  --summary_.num_images;
  summary_.left_out.push_back(why);
}

void StageRunner::End() {
  // The driver takes a while to free page-locked memory: beside the last files rather than after them.
  ThreadGroup beside;
  for (const auto& backend : backends_) beside.StartIfPossible([&backend] { backend->FreeMemory(); });
  loop_.End();
  beside.Join();
  summary_.inference = loop_.Inference();
  summary_.peak_host_bytes = PeakHostBytes();
  summary_.peak_cache_bytes = store().peak_bytes();
  summary_.bytes_written = store().writers().bytes_written();
  summary_.write_seconds = store().writers().busy_seconds();
  for (const auto& backend : backends_) summary_.devices.push_back(SummarizeDevice(*backend));
}

void StageRunner::AddToRecord() { record_.AddRun(SummaryJson(summary_, phi::UtcNow())); }

}  // namespace colmap_ext
