// phimvs hole_filler: plane hypothesis inference on a workspace that has maps already, COLMAP's own included.
#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/stereo_options.h"
#include "colmap_ext/pipeline/hole_filling.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {

int RunHoleFiller(int argc, char** argv) {
  StereoCommandOptions options;
  OptionParser parser("hole_filler", "fills the holes of a workspace's depth maps with plane hypotheses");
  options.Register(&parser);
  if (!parser.Parse(argc, argv)) return 0;
  options.Finish(parser);

  const Workspace workspace(options.workspace);
  std::vector<ImageJob> jobs = MakeImageJobs(workspace, MakeSparseScene(workspace.model()),
                                             options.config_path, options.pipeline.view_selection);
  const WorkspaceLock lock(workspace.StereoFolder());
  RemoveTemporaryFiles(workspace.StereoFolder());
  const auto backends = MakeBackends(options.backend);
  HoleFilling filling(workspace, std::move(jobs), options.pipeline, parser.EffectiveValues(), backends);
  const RunSummary summary = filling.Run();
  for (const std::string& line : SummaryLines(summary)) phi::LogInfo(line);
  return static_cast<int>(summary.Code());
}

}  // namespace colmap_ext
