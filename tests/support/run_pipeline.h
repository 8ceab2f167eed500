// Runs the stereo pipeline with backends that pretend.
#pragma once

#include "colmap_ext/pipeline/stereo_pipeline.h"
#include "colmap_ext/workspace.h"

namespace test_support {

// All images of the workspace, whose sparse points have depths from 1 to 10.
colmap_ext::RunSummary RunPipeline(const colmap_ext::WorkspaceOptions& workspace,
                                   const colmap_ext::PipelineOptions& options, const colmap_ext::Backends& backends);

}  // namespace test_support
