// Runs a stage over the images that need it: tasks on the devices, results into store and record, counts into the summary.
// patch_match_stereo and hole_filler differ in which stages and images those are.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/backend_choice.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/run_summary.h"
#include "colmap_ext/pipeline/stage_tasks.h"
#include "colmap_ext/pipeline/task_queue.h"
#include "colmap_ext/progress.h"

namespace colmap_ext {

// One stage's share of a run. All vectors but `pending` are by job.
struct StageWork {
  const Stage& stage;
  const Stage* previous;                       // null before the first
  const std::vector<std::string>& input_keys;  // of the stage before; empty: it made no map
  const std::vector<int>& pending;
  const std::vector<std::string>& keys;  // of the results
};

class StageRunner {
 public:
  // References must outlive it.
  StageRunner(const Workspace& workspace, const std::vector<ImageJob>& jobs, const PipelineOptions& options,
              SparseDepthFunction sparse_depth, const Backends& backends);

  RunRecord& record() { return record_; }
  const RunRecord& record() const { return record_; }
  MapStore& store() { return store_; }
  const MapStore& store() const { return store_; }
  RunSummary& summary() { return summary_; }
  ProgressLine& progress() { return *progress_; }

  // Before the first Run: the stages by their numbers.
  void Begin(const std::vector<Stage>& stages);
  // Does the pending jobs of stage `number`, waits for them, and gives up the maps of the stage before. Returns the jobs that
  // failed; log, summary and record tell of them already. Throws as RunTasks.
  std::vector<int> Run(int number, const StageWork& work);
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
  void RunTask(int number, const StageWork& work, int job, phi::Backend& backend);
  void Count(int number, int job, const phi::MeasurementMap& map);
  void Save(const Stage& stage, int job, const StageResult& result, const TaskRecord& record);
  void RecordFailure(const StageWork& work, const TaskFailure& failure);

  const Workspace& workspace_;
  const std::vector<ImageJob>& jobs_;
  const Backends& backends_;
  RunRecord record_;
  MapStore store_;
  StageTasks tasks_;
  std::unique_ptr<ProgressLine> progress_;

  std::mutex mutex_;  // guards what follows while tasks run
  RunSummary summary_;
  std::vector<int> nearly_empty_;
};

}  // namespace colmap_ext
