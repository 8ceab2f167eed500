#include "tests/support/run_pipeline.h"

#include "colmap_ext/pipeline/image_jobs.h"

namespace test_support {

colmap_ext::RunSummary RunPipeline(const colmap_ext::WorkspaceOptions& workspace_options,
                                   const colmap_ext::PipelineOptions& options, const colmap_ext::Backends& backends) {
  const colmap_ext::Workspace workspace(workspace_options);
  const phi::SparseScene scene = MakeSparseScene(workspace.model());
  const auto sparse_depth = [](int) { return phi::SparseDepth{{}, {1, 10}}; };
  colmap_ext::StereoPipeline pipeline({workspace, MakeImageJobs(workspace, scene, "", options.view_selection), sparse_depth},
                                      options, {{"option", "value"}}, backends);
  return pipeline.Run();
}

}  // namespace test_support
