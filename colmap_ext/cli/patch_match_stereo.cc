// phimvs patch_match_stereo: depth and normal maps for every image of an undistorted workspace.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/steps.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/stereo_pipeline.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/initialization.h"

namespace colmap_ext {
namespace {

// What the run reads of a workspace.
struct StereoInput {
  explicit StereoInput(const StereoCommandOptions& options)
      : workspace(options.workspace),
        scene(MakeSparseScene(workspace.model())),
        sparse_depth(workspace.views(), scene),
        jobs(MakeImageJobs(workspace, scene, options.config_path, options.pipeline.view_selection)) {}

  Workspace workspace;
  phi::SparseScene scene;
  phi::SparseDepthSource sparse_depth;
  std::vector<ImageJob> jobs;
};

}  // namespace

int EstimateMaps(const StereoCommandOptions& options,
                 const std::map<std::string, std::string>& effective_options) {
  const StereoInput input(options);
  const WorkspaceLock lock(input.workspace.StereoFolder());
  RemoveTemporaryFiles(input.workspace.StereoFolder());
  const auto backends = MakeBackends(options.backend);
  StereoPipeline pipeline(
      input.workspace, input.jobs, [&](int image) { return input.sparse_depth.ForView(image); },
      options.pipeline, effective_options, backends);
  try {
    const RunSummary summary = pipeline.Run();
    LogSummary(summary);
    return static_cast<int>(summary.Code());
  } catch (const phi::Cancelled&) {
    phi::LogWarning("finished maps are kept; the same command goes on where this one stopped");
    throw;
  }
}

int RunPatchMatchStereo(int argc, char** argv) {
  StereoCommandOptions options;
  OptionParser parser("patch_match_stereo", "depth and normal maps of an undistorted COLMAP workspace");
  options.Register(&parser);
  if (!parser.Parse(argc, argv)) return 0;
  options.Finish(parser);
  return EstimateMaps(options, parser.EffectiveValues());
}

}  // namespace colmap_ext
