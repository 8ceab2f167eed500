// --PatchMatchStereo.depth_min and depth_max, against what the sparse points tell.
#pragma once

#include <string>
#include <vector>

#include "colmap_ext/pipeline/pipeline_options.h"
#include "phi/scene_view.h"
#include "phi/sparse_scene.h"

namespace colmap_ext {

// What is to be said of a range that hardly a sparse point lies in, as where its unit is another; empty where some do. World units;
// depth_min < 0: no range is given.
std::string GivenDepthsWarning(const phi::SparseScene& scene, const std::vector<phi::SceneView>& views, double depth_min,
                               double depth_max);

// Says it.
void WarnOfGivenDepths(const phi::SparseScene& scene, const std::vector<phi::SceneView>& views, const PipelineOptions& options);

}  // namespace colmap_ext
