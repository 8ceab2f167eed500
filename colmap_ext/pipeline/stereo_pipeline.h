// The whole of patch_match_stereo: one task per stage and image, each begun when the maps that it reads are there.
//
//   estimate -> photometric maps -> share, filter and judge -> measured maps -> infer and filter -> geometric maps
//
// A stage reads what the stage before made of an image and its sources, never what it makes itself, so results
// depend neither on the order of the tasks nor on how many run at once. Where a run stopped, the next one
// goes on.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "colmap_ext/fusion/handed_maps.h"
#include "colmap_ext/pipeline/shard_scope.h"
#include "colmap_ext/pipeline/stage_runner.h"

namespace colmap_ext {

// The images of a workspace that are to be done, and what the sparse model tells of their depths.
struct SceneJobs {
  const Workspace& workspace;
  std::vector<ImageJob> jobs;  // of a shard, those in reach of ScopeOf alone need input keys
  SparseDepthFunction sparse_depth;
};

class StereoPipeline {
 public:
  // `effective_options` goes into phimvs.json for the reader. References must outlive the pipeline.
  StereoPipeline(SceneJobs scene, const PipelineOptions& options, const std::map<std::string, std::string>& effective_options,
                 const Backends& backends, const Shard& shard = {});

  // Throws phi::InputError for maps of another program, phi::Cancelled when asked to stop; images that cannot
  // be done are in the summary, and all others are done; of a shard those whose inputs others have made.
  RunSummary Run();

  // Before Run, where fusion follows in the same process: what it reads is kept in memory as long as the stages do not need
  // its place.
  void KeepForFusion() { runner_.store().KeepPhotos(); }
  // After Run, once: what is in memory of the last stage's maps and of the photos.
  HandedMaps HandOver();

 private:
  bool IsShard() const { return !shard_.IsWhole(); }
  void BeginShard();
  void ReportImpossibleJobs();
  void RecordImpossibleJobs();
  // Throws phi::InputError where no image can be done.
  void RequirePossibleJob();
  // Throws phi::InputError for the first file of another program, unless it may be replaced.
  void CheckFiles();
  void RefuseForeignFile(const std::filesystem::path& path) const;
  std::vector<StagePlan> Plan() const;
  // Before this run, or by another shard.
  bool WasDone(int stage, int job, const std::string& key) const;
  FoundFiles Inspect(int stage, int job) const;
  // An image that failed in another shard is not waited for.
  bool FailedElsewhere(int stage, int job, const std::string& key) const;
  void RunStages();
  void CountKept(const StagePlan& last);
  void ReportWaiting(const std::vector<StagePlan>& plan);
  // Gives the maps of earlier runs the form that this one was asked for.
  void ConvertMaps();
  void ConfirmKeptMaps(const std::vector<StagePlan>& plan);
  void RemoveIntermediateFiles();
  void LogPlan(const std::vector<StagePlan>& plan);
  void WarnOfFewWitnesses() const;
  void WarnOfEmptyMaps();
  const std::string& NameOf(int job) const { return runner_.NameOf(job); }
  bool WritesCost(int stage) const;

  const Workspace& workspace_;
  const PipelineOptions options_;
  const std::vector<ImageJob> jobs_;
  const std::vector<Stage> stages_;
  const Shard shard_;
  const PlanScope scope_;
  const std::vector<int> own_;  // jobs of the scope
  const Backends& backends_;
  StageRunner runner_;
  bool had_work_ = false;  // some last map was to be made when the run began
  std::vector<std::vector<char>> files_whole_;  // by stage and job of the scope, when the run began
};

}  // namespace colmap_ext
