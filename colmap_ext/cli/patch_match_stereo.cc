// phimvs patch_match_stereo: depth and normal maps for every image of an undistorted workspace.
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/cli/command.h"
#include "colmap_ext/cli/shard_options.h"
#include "colmap_ext/cli/steps.h"
#include "colmap_ext/dim_photos.h"
#include "colmap_ext/fusion_config.h"
#include "colmap_ext/missing_images.h"
#include "colmap_ext/pipeline/given_depths.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/image_moves.h"
#include "colmap_ext/pipeline/shard_scope.h"
#include "colmap_ext/pipeline/stereo_pipeline.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "colmap_ext/rig_frames.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/sparse_depth.h"

namespace colmap_ext {
namespace {

// What the run reads of a workspace. Selecting sources takes minutes for a large model.
struct StereoInput {
  StereoInput(Workspace read, const StereoCommandOptions& options, const Shard& shard)
      : workspace(std::move(read)),
        scene(MakeSparseScene(workspace.model())),
        sparse_depth(workspace.views(), scene, options.pipeline.stereo.method.rules),
        jobs(ListImageJobs(workspace, scene, options.config_path, options.pipeline.view_selection)) {
    workspace.DropObservations();  // the scene has those of points
    MoveImages(scene, options.pipeline.stereo, &workspace);
    WarnOfGivenDepths(scene, workspace.views(), options.pipeline);
    const std::vector<Stage> stages = StagesOf(options.pipeline, shard);
    const PlanScope scope = ScopeOf(stages, shard, static_cast<int>(jobs.size()));
    AddInputs(workspace, scene, options.pipeline.view_selection.method.formulas, JobsInReach(stages, jobs, scope), &jobs);
  }

  Workspace workspace;
  phi::SparseScene scene;
  phi::SparseDepthSource sparse_depth;
  std::vector<ImageJob> jobs;
};

}  // namespace

int EstimateMaps(const StereoCommandOptions& options, const std::map<std::string, std::string>& effective_options,
                 const Shard& shard, HandedMaps* handed) {
  using Sharing = WorkspaceLock::Sharing;
  Workspace workspace(options.workspace);
  RequireAnImage(workspace);
  if (handed != nullptr && std::filesystem::exists(workspace.StereoFolder() / "fusion.cfg")) {
    ReadFusionConfig(workspace);  // a mistake there must not come out after hours of stereo
  }
  const WorkspaceLock lock(workspace.StereoFolder(), shard.IsWhole() ? Sharing::kAlone : Sharing::kWithShards);
  const GpuStart gpus(options.backend);  // beside the choice of views
  WarnOfFrames(workspace);
  if (const std::string dim = DescribeDimPhotosOfSome(workspace); !dim.empty()) phi::LogWarning(dim);
  const StereoInput input(std::move(workspace), options, shard);
  if (shard.IsWhole()) {
    RemoveTemporaryFiles(input.workspace.StereoFolder());
  } else {
    KeepLeftOvers();
  }
  const auto backends = MakeBackends(options.backend, input.workspace.LargestImage());
  StereoPipeline pipeline({input.workspace, input.jobs, [&](int image) { return input.sparse_depth.ForView(image); }},
                          options.pipeline, effective_options, backends, shard);
  if (handed != nullptr) pipeline.KeepForFusion();
  try {
    const RunSummary summary = pipeline.Run();
    LogSummary(summary);
    if (handed != nullptr) *handed = pipeline.HandOver();
    return static_cast<int>(summary.Code());
  } catch (const phi::Cancelled&) {
    phi::LogWarning("finished maps are kept; the same command goes on where this one stopped");
    throw;
  }
}

namespace {

int PrintStages(const PipelineOptions& options) {
  for (const Stage& stage : BuildStages(options)) std::cout << stage.result << "\n";
  return static_cast<int>(phi::ExitCode::kOk);
}

}  // namespace

int RunPatchMatchStereo(int argc, char** argv) {
  StereoCommandOptions options;
  OptionParser parser("patch_match_stereo", "depth and normal maps of an undistorted COLMAP workspace");
  options.Register(&parser);
  ShardOptions shard;
  parser.Append(shard.List());
  parser.Add("stage", &shard.stage, "Make this kind of maps only, such as photometric; list = print the kinds and end");
  if (!parser.Parse(argc, argv)) return 0;
  options.Finish(parser);
  if (shard.stage == "list") return PrintStages(options.pipeline);
  return EstimateMaps(options, parser.EffectiveValues(), shard.Resolve());
}

}  // namespace colmap_ext
