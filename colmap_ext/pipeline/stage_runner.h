// Runs stages over the images that need them: results into store and record, counts into the summary.
// patch_match_stereo and hole_filler differ in which stages those are, and in what was there before.
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

  // Before the first Plan: the stages by their numbers.
  void Begin(std::vector<Stage> stages);
  // What is still to be made; see StageLoop.
  std::vector<StagePlan> Plan(const PlanQueries& earlier, const PlanScope& scope = {}) const {
    return loop_.Plan(earlier, scope);
  }
  // Does what is pending, but not the stages after one that is likely to fail again: without its result the others may all be
  // done. Log, summary and record tell of a failure when it happens. Throws as RunTasks.
  void Run(const std::vector<StagePlan>& plan);
  // A job that cannot be done, at any time: log and summary.
  void Fail(int job, const std::string& stage, const phi::Message& message, bool is_too_large = false);
  // An image that is not counted, before the first Run: the same as a warning.
  void LeaveOut(const phi::Message& why);
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

  const Stage& StageOf(int number) const { return loop_.stages()[number]; }
  RunRecord::Task TaskOf(int stage, int job) const { return {NameOf(job), StageOf(stage).result}; }
  // Whether a task failed in an earlier run, for the same inputs.
  bool HasFailedBefore(int stage, const StagePlan& plan) const;
  void BeginTasks(int stage, const StagePlan& plan);
  void Keep(int stage, int job, const std::string& key, const TaskOutcome& outcome);
  void Count(int stage, int job, const TaskOutcome& outcome);
  void Save(int stage, int job, const StageResult& result, const TaskRecord& record);
  void RecordFailure(const JobFailure& failure, const std::string& key);

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
