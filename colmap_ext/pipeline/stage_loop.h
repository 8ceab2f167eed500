// Runs the tasks of stages on the devices, tells their progress, and gives up the maps that no later task reads. Where the
// results go is its caller's: a workspace and its record (StageRunner), or memory (memory_scene.h).
//
// A task begins when the maps that it reads are there, whatever the other images' state: no stage waits for the one before.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/pipeline/backend_choice.h"
#include "colmap_ext/pipeline/map_store.h"
#include "colmap_ext/pipeline/stage_tasks.h"
#include "colmap_ext/pipeline/task_queue.h"
#include "colmap_ext/progress.h"

namespace colmap_ext {

// One stage's share of a run. All vectors but `pending` are by job.
struct StageWork {
  int number;  // of the stage, in the order of Begin
  const Stage& stage;
  const Stage* previous;                       // null before the first
  const std::vector<std::string>& input_keys;  // of the stage before; empty: it made no map
  const std::vector<int>& pending;
  const std::vector<std::string>& keys;  // of the results
};

struct JobFailure {
  int stage = 0, job = 0;
  std::string message;
};

// Of pending tasks; the others were done.
struct LoopOutcome {
  std::vector<JobFailure> failures;
  std::vector<std::pair<int, int>> left_out;  // (stage, job): something that they read was not made
};

struct TaskOutcome {
  StageResult result;
  std::vector<std::string> warnings;  // logged already
  double seconds = 0;
};

class StageLoop {
 public:
  // References must outlive it.
  StageLoop(const Workspace& workspace, const std::vector<ImageJob>& jobs, const PipelineOptions& options,
            SparseDepthFunction sparse_depth, const Backends& backends, std::int64_t cache_bytes);

  // Before the first Run: the stages by their numbers.
  void Begin(const std::vector<Stage>& stages);
  using KeepFunction = std::function<void(const StageWork& work, int job, TaskOutcome outcome)>;
  // Does the pending jobs of these stages, ascending and without a gap, and waits for them. `keep` gets what they make, from
  // several threads at once. Throws as RunTasks.
  LoopOutcome Run(const std::vector<StageWork>& works, const KeepFunction& keep);
  // After the last Run: writes what waits, and ends the progress line.
  void End();

  MapStore& store() { return store_; }
  const MapStore& store() const { return store_; }
  ProgressLine& progress() { return *progress_; }
  InferenceSummary Inference() const { return tasks_.Inference(); }

 private:
  void RunTask(const StageWork& work, int job, phi::Backend& backend, const KeepFunction& keep);

  const Workspace& workspace_;
  const std::vector<ImageJob>& jobs_;
  const Backends& backends_;
  MapStore store_;
  StageTasks tasks_;
  std::unique_ptr<ProgressLine> progress_;
};

}  // namespace colmap_ext
