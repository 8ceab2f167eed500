// Plane hypothesis inference and the second filter on maps that are already there: hole_filler's work.
//
// Always starts from <image>.measured.bin. Where <image>.geometric.bin is another program's, it gets that name first, so
// that running twice gives the same bytes.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/run_summary.h"
#include "colmap_ext/pipeline/stage_tasks.h"
#include "colmap_ext/pipeline/task_queue.h"

namespace colmap_ext {

class HoleFilling {
 public:
  using Backends = std::vector<std::unique_ptr<phi::Backend>>;

  // `effective_options` goes into phimvs.json for the reader. References must outlive it.
  HoleFilling(const Workspace& workspace, std::vector<ImageJob> jobs, const PipelineOptions& options,
              const std::map<std::string, std::string>& effective_options, const Backends& backends);

  // Writes <image>.geometric.bin and the filled masks. Throws phi::InputError when no image has maps, or when another
  // program's would be replaced without --overwrite; images that
  // cannot be done are in the summary, and all others are done.
  RunSummary Run();

 private:
  void Summarize(double seconds);
  void FindMeasuredMaps();
  bool GeometricMapIsOurs(int job) const;
  bool ImportMeasuredMap(int job);
  std::shared_ptr<const phi::Mask> NoMask(int job) const;
  void Fail(int job, const std::string& stage, const std::string& message);
  void RunStages(const std::vector<Stage>& stages);
  void RunStage(const Stage& stage, const Stage& previous);
  void Save(const Stage& stage, int job, const StageResult& result, const TaskRecord& record);
  const std::string& NameOf(int job) const { return workspace_.views()[jobs_[job].image].name; }

  const Workspace& workspace_;
  const PipelineOptions options_;
  const std::vector<ImageJob> jobs_;
  const Backends& backends_;
  RunRecord record_;
  MapStore store_;
  StageTasks tasks_;
  std::vector<std::string> keys_;  // by job: of its maps; empty where it has none
  RunSummary summary_;
  std::unique_ptr<ProgressLine> progress_;
};

}  // namespace colmap_ext
