// Runs stages over the images that need them: results into store and record, counts into the summary.
// patch_match_stereo and hole_filler differ in which stages and images those are.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/run_summary.h"
#include "colmap_ext/pipeline/stage_loop.h"

namespace colmap_ext {

class StageRunner {
 public:
  // References must outlive it.
  StageRunner(const Workspace& workspace, const std::vector<ImageJob>& jobs, const PipelineOptions& options,
              SparseDepthFunction sparse_depth, const Backends& backends);

  RunRecord& record() { return record_; }
  const RunRecord& record() const { return record_; }
  MapStore& store() { return loop_.store(); }
  const MapStore& store() const { return loop_.store(); }
  RunSummary& summary() { return summary_; }
  ProgressLine& progress() { return loop_.progress(); }

  // Before the first Run: the stages by their numbers.
  void Begin(const std::vector<Stage>& stages);
  // Does the pending jobs of these stages, ascending and without a gap, and waits for them. Log, summary and record
  // tell of failures already. Throws as RunTasks.
  LoopOutcome Run(const std::vector<StageWork>& works);
  // A job that cannot be done, at any time: log and summary.
  void Fail(int job, const std::string& stage, const std::string& message);
  // After the last Run: writes what waits, and ends the progress line.
  void End();
  // The summary, into the record.
  void AddToRecord();

  // Jobs whose map of the last stage has hardly any depth.
  const std::vector<int>& nearly_empty() const { return nearly_empty_; }
  const std::string& NameOf(int job) const;

 private:
  // From its first task's begin to its last one's end.
  struct TimeSpan {
    std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::time_point::max(), end = {};
  };

  void Begin(const StageWork& work);
  void Keep(const StageWork& work, int job, const TaskOutcome& outcome);
  void Count(int number, int job, const TaskOutcome& outcome);
  void Save(const Stage& stage, int job, const StageResult& result, const TaskRecord& record);
  void RecordFailure(const StageWork& work, const JobFailure& failure);

  const Workspace& workspace_;
  const std::vector<ImageJob>& jobs_;
  const Backends& backends_;
  RunRecord record_;
  StageLoop loop_;

  std::mutex mutex_;  // guards what follows while tasks run
  RunSummary summary_;
  std::vector<TimeSpan> spans_;  // by stage, of the Run under way
  std::vector<int> nearly_empty_;
};

}  // namespace colmap_ext
