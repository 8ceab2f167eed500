#include "colmap_ext/pipeline/stage_loop.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// Enough to keep up with several devices, few enough that what waits to be written stays small.
int NumWriters(const Backends& backends) {
  int num_workers = 0;
  for (const auto& backend : backends) num_workers += std::max(1, backend->NumConcurrentImages());
  return std::clamp(num_workers, 2, 8);
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

std::vector<TaskFailure> StageLoop::Run(int number, const StageWork& work,
                                        const std::function<void(int job, TaskOutcome outcome)>& keep) {
  using Clock = std::chrono::steady_clock;
  progress_->BeginStage(number);
  const std::vector<TaskFailure> failures =
      RunTasks(work.pending, backends_, [&](int job, phi::Backend& backend) {
        const Clock::time_point begin = Clock::now();
        ProgressLine::Task progress(progress_.get());
        TaskOutcome outcome;
        outcome.result = tasks_.Run(work.stage, work.previous, work.input_keys, job, backend, &progress,
                                    &outcome.warnings);
        const std::string& name = workspace_.views()[jobs_[job].image].name;
        for (const std::string& warning : outcome.warnings) phi::LogWarning("image " + name + ": " + warning);
        outcome.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
        keep(job, std::move(outcome));
      });
  if (work.previous != nullptr) {  // no other stage reads those maps
    for (const ImageJob& job : jobs_) store_.Forget(job.image, work.previous->result);
  }
  return failures;
}

void StageLoop::End() {
  store_.Drain();
  progress_.reset();
}

}  // namespace colmap_ext
