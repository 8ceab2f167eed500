// Runs the tasks of a stage on the devices, tells their progress, and gives up the maps that no later stage reads. Where the
// results go is its caller's: a workspace and its record (StageRunner), or memory (memory_scene.h).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/backend_choice.h"
#include "colmap_ext/pipeline/map_store.h"
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
  // Does the pending jobs of stage `number` and waits for them. `keep` gets what they make, from several threads at once.
  // Throws as RunTasks.
  std::vector<TaskFailure> Run(int number, const StageWork& work,
                               const std::function<void(int job, TaskOutcome outcome)>& keep);
  // After the last Run: writes what waits, and ends the progress line.
  void End();

  MapStore& store() { return store_; }
  const MapStore& store() const { return store_; }
  ProgressLine& progress() { return *progress_; }
  InferenceSummary Inference() const { return tasks_.Inference(); }

 private:
  const Workspace& workspace_;
  const std::vector<ImageJob>& jobs_;
  const Backends& backends_;
  MapStore store_;
  StageTasks tasks_;
  std::unique_ptr<ProgressLine> progress_;
};

}  // namespace colmap_ext
