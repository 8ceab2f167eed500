// phimvs hole_filler: plane hypothesis inference on a workspace that has maps already, COLMAP's own included.
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/stereo_options.h"
#include "colmap_ext/map_scale.h"
#include "colmap_ext/missing_images.h"
#include "colmap_ext/pipeline/given_depths.h"
#include "colmap_ext/pipeline/hole_filling.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/original_maps.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "colmap_ext/rig_frames.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {

namespace {

// Of a hole filling, the exit code.
int Fill(const StereoCommandOptions& options, const std::map<std::string, std::string>& effective_options,
         const Workspace& workspace, std::vector<ImageJob> jobs) {
  const auto backends = MakeBackends(options.backend, workspace.LargestImage());
  phi::LogInfo(DescribeJobs(workspace, jobs) + ", " + backends.front()->Name());
  HoleFilling filling(workspace, std::move(jobs), options.pipeline, effective_options, backends);
  const RunSummary summary = filling.Run();
  LogSummary(summary);
  return static_cast<int>(summary.Code());
}

}  // namespace

int RunHoleFiller(int argc, char** argv) {
  StereoCommandOptions options;
  bool restore = false;
  OptionParser parser("hole_filler", "Fill the holes of depth maps that you have, COLMAP's included");
  options.RegisterFilling(&parser);
  parser.Add("restore", &restore, "Fill nothing, but put back the maps of another program that were filled");
  if (!parser.Parse(argc, argv)) return 0;
  options.Finish(parser);
  parser.WarnWithoutEffect({"PatchMatchStereo.filter_min_ncc"},
                           "maps that are there come without matching costs; patch_match_stereo filters by them");

  Workspace workspace(options.workspace);
  if (!restore) RequireAnImage(workspace);
  WarnOfFrames(workspace);
  const WorkspaceLock lock(workspace.StereoFolder());
  const phi::SparseScene scene = MakeSparseScene(workspace.model());
  std::vector<ImageJob> jobs = MakeImageJobs(workspace, scene, options.config_path, options.pipeline.view_selection);
  workspace.DropObservations();
  RemoveTemporaryFiles(workspace.StereoFolder());
  if (!restore) {
    WarnOfMapScale(workspace, {kGeometric, kMeasured});
    WarnOfGivenDepths(scene, workspace.views(), options.pipeline);
    return Fill(options, parser.EffectiveValues(), workspace, std::move(jobs));
  }
  const int num_restored = RestoreOriginalMaps(workspace, jobs);
  phi::LogInfo("the maps of " + std::to_string(num_restored) + " of " + std::to_string(jobs.size()) +
               " images are the other program's again");
  return static_cast<int>(phi::ExitCode::kOk);
}

}  // namespace colmap_ext
