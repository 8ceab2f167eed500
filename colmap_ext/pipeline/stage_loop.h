// Plans and runs the stages of a chain: which results are still to be made, what each needs, their tasks on the devices, their
// progress, and when a map may be given up because no later task reads it. Whoever runs stages runs them so, and says what was
// there before and where the results go: a workspace and its record (StageRunner), or memory (memory_scene.h).
//
// A task begins when the maps that it reads are there, whatever the other images' state: no stage waits for the one before.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/backend_choice.h"
#include "colmap_ext/pipeline/map_store.h"
#include "colmap_ext/pipeline/stage_tasks.h"
#include "colmap_ext/pipeline/thread_group.h"
#include "colmap_ext/progress.h"

namespace colmap_ext {

struct JobFailure {
  int stage = 0, job = 0;
  phi::Message message;
  bool is_too_large = false;  // see TaskFailure
};

struct TaskOutcome {
  StageResult result;
  std::vector<phi::Message> unread_sources;  // source images that were left out, and why
  double seconds = 0;
};

// Before the reason, in log and record.
inline constexpr char kSourceLeftOut[] = "source image left out: ";

class StageLoop {
 public:
  // References must outlive it.
  StageLoop(const Workspace& workspace, const std::vector<ImageJob>& jobs, const PipelineOptions& options,
            SparseDepthFunction sparse_depth, const Backends& backends, std::int64_t cache_bytes);

  // Before the first Plan: the stages by their numbers.
  void Begin(std::vector<Stage> stages);
  // What is still to be made. `earlier` tells of results that are not this loop's.
  std::vector<StagePlan> Plan(const PlanQueries& earlier, const PlanScope& scope = {}) const;
  using KeepFunction = std::function<void(int stage, int job, TaskOutcome outcome)>;
  using FailFunction = std::function<void(const JobFailure& failure)>;
  // Does what is pending of the stages before end_stage, and waits for it. What reads a map that was not made is left out: the
  // next plan has it again, without that map. `keep` gets the results, `fail` what fails, when it does; both are called from several
  // threads at once. Throws as RunTasks.
  void Run(const std::vector<StagePlan>& plan, int end_stage, const KeepFunction& keep, const FailFunction& fail);
  // After the last Run: writes what waits, ends the progress line, and warns of source images that were left out.
  void End();

  const std::vector<Stage>& stages() const { return stages_; }
  MapStore& store() { return store_; }
  const MapStore& store() const { return store_; }
  InferenceSummary Inference() const { return tasks_.Inference(); }

 private:
  enum class State : char { kOpen, kMade, kFailed };

  void TellNumTasks(const std::vector<StagePlan>& plan);
  bool InferenceFollows(const std::vector<StagePlan>& plan, int job) const;
  // On a thread of `beside`, where the host has little to do while the device works on this task, and inference of the image follows.
  void PrepareInference(const std::vector<StagePlan>& plan, int stage, int job, const phi::Backend& backend,
                        ThreadGroup* beside) const;
  void RunTask(const std::vector<StagePlan>& plan, int stage, int job, phi::Backend& backend,
               const KeepFunction& keep);
  // One photo that cannot be read is a source of many images, in every stage: that is detail, and its reason told once, in the end.
  void NoteUnreadSources(int image, const std::vector<phi::Message>& unread);
  // Of the file that a failure is about, if there is one.
  void NoteFailedFile(const std::string& file);
  // Of those whose reason no failure has told.
  void WarnOfUnreadSources();

  const Workspace& workspace_;
  const std::vector<ImageJob>& jobs_;
  const Backends& backends_;
  MapStore store_;
  StageTasks tasks_;
  std::vector<Stage> stages_;
  std::vector<std::vector<State>> states_;  // by stage and job
  std::unique_ptr<ProgressLine> progress_;
  std::mutex told_mutex_;                               // guards what follows while tasks run
  std::map<std::string, phi::Message> unread_sources_;  // by their sentences
  std::set<std::string> failed_files_;
};

}  // namespace colmap_ext
