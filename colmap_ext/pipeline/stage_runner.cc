#include "colmap_ext/pipeline/stage_runner.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "phi/base/error.h"
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

void StageRunner::Begin(const std::vector<Stage>& stages) {
  for (const Stage& stage : stages) summary_.stages.push_back({.name = stage.result});
  loop_.Begin(stages);
}

LoopOutcome StageRunner::Run(const std::vector<StageWork>& works) {
  for (const StageWork& work : works) Begin(work);
  spans_.assign(summary_.stages.size(), {});
  LoopOutcome outcome = loop_.Run(works, [this](const StageWork& work, int job, const TaskOutcome& outcome) {
    Keep(work, job, outcome);
  });
  for (std::size_t s = 0; s < spans_.size(); ++s) {
    const std::chrono::duration<double> span = spans_[s].end - spans_[s].begin;
    if (span.count() > 0) summary_.stages[s].seconds += span.count();
  }
  for (const JobFailure& failure : outcome.failures) {
    const auto work =
        std::find_if(works.begin(), works.end(), [&](const auto& w) { return w.number == failure.stage; });
    RecordFailure(*work, failure);
  }
  return outcome;
}

void StageRunner::Begin(const StageWork& work) {
  if (work.stage.transient || work.pending.empty()) return;
  std::vector<RunRecord::Task> tasks;
  std::vector<std::string> keys;
  for (const int job : work.pending) {
    tasks.emplace_back(NameOf(job), work.stage.result);
    keys.push_back(work.keys[job]);
  }
  record_.Begin(tasks, keys);
}

void StageRunner::Keep(const StageWork& work, int job, const TaskOutcome& outcome) {
  TaskRecord record;
  record.warnings = outcome.warnings;
  record.state = "done";
  record.key = work.keys[job];
  record.seconds = outcome.seconds;
  record.peak_memory_bytes = PeakHostBytes();
  Save(work.stage, job, outcome.result, record);
  Count(work.number, job, outcome);
}

void StageRunner::Count(int number, int job, const TaskOutcome& outcome) {
  const phi::MeasurementMap& map = *outcome.result.map;
  const std::int64_t num_with_depth = phi::CountPublished(map);
  const auto num_pixels = static_cast<std::int64_t>(map.size());
  const Clock::time_point now = Clock::now();
  const auto begin =
      now - std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(outcome.seconds));
  std::lock_guard<std::mutex> lock(mutex_);
  spans_[number] = {std::min(spans_[number].begin, begin), now};
  StageSummary& stage = summary_.stages[number];
  ++stage.num_made;
  stage.num_pixels += num_pixels;
  stage.num_with_depth += num_with_depth;
  const bool is_last = number + 1 == static_cast<int>(summary_.stages.size());
  if (is_last && static_cast<double>(num_with_depth) < kHardlyAny * static_cast<double>(num_pixels))
    nearly_empty_.insert(std::lower_bound(nearly_empty_.begin(), nearly_empty_.end(), job), job);
}

void StageRunner::Save(const Stage& stage, int job, const StageResult& result, const TaskRecord& record) {
  if (stage.transient) {
    store().KeepTransient(jobs_[job].image, stage.result, result);
    return;
  }
  store().Write(jobs_[job].image, stage.result, result,
                [this, task = RunRecord::Task(NameOf(job), stage.result),
                 record = record](const std::vector<FileIdentity>& files) mutable {
                  record.files = files;
                  record_.Finish(task, record);
                });
}

void StageRunner::RecordFailure(const StageWork& work, const JobFailure& failure) {
  Fail(failure.job, work.stage.result, failure.message);
  if (work.stage.transient) return;
  TaskRecord record;
  record.state = "failed";
  record.key = work.keys[failure.job];
  record.warnings = {failure.message};
  record_.Finish({NameOf(failure.job), work.stage.result}, record);
}

void StageRunner::Fail(int job, const std::string& stage, const std::string& message) {
  phi::LogError(message);
  summary_.failures.push_back({NameOf(job), stage, message});
}

void StageRunner::End() {
  loop_.End();
  summary_.inference = loop_.Inference();
  summary_.peak_host_bytes = PeakHostBytes();
  summary_.peak_cache_bytes = store().cache().peak_bytes();
  summary_.bytes_written = store().writers().bytes_written();
  summary_.write_seconds = store().writers().busy_seconds();
  for (const auto& backend : backends_) summary_.devices.push_back(SummarizeDevice(*backend));
}

void StageRunner::AddToRecord() { record_.AddRun(SummaryJson(summary_, phi::UtcNow())); }

}  // namespace colmap_ext
