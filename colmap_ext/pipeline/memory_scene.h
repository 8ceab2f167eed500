// The stages on a scene in memory: photos in, maps and points out, nothing on the disk. The same stages as of a workspace,
// and of the same input the same values.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/pipeline/backend_choice.h"
#include "colmap_ext/pipeline/pipeline_options.h"
#include "colmap_ext/workspace.h"
#include "phi/backend.h"
#include "phi/base/message.h"

namespace colmap_ext {

// Of one image, at the workspace's working resolution.
struct SceneMaps {
  std::shared_ptr<const phi::PlaneMap> map;    // depth <= 0: none
  std::shared_ptr<const phi::CostMap> cost;    // of the last estimation; null where nothing was estimated
  std::shared_ptr<const phi::Mask> inferred;   // 0: measured, or no depth; null: nothing was inferred
  phi::Message problem;                        // not empty: why the image could not be done; its map has no depth
};

// Parallel to workspace.views(), of a workspace in memory. sources: as of MakeMemoryJobs. Throws phi::InputError when no
// image can be done, phi::Cancelled when asked to stop.
std::vector<SceneMaps> EstimateScene(const Workspace& workspace, const std::vector<std::vector<int>>& sources,
                                     const PipelineOptions& options, const Backends& backends);

// Fills the holes of maps that are there; `measured` is parallel to workspace.views(), each of its view's size.
std::vector<SceneMaps> FillScene(const Workspace& workspace, const std::vector<std::vector<int>>& sources,
                                 const std::vector<std::shared_ptr<const phi::PlaneMap>>& measured,
                                 const PipelineOptions& options, const Backends& backends);

// Points in the order of the command's cloud, block after block; their views are indices into workspace.views().
struct SceneCloud {
  std::vector<phi::FusedBlock> blocks;
  SceneFusionReport report;  // with the number of points
};

// maps: parallel to workspace.views(), each of the shape of its view's image.
SceneCloud FuseSceneMaps(const Workspace& workspace, const std::vector<SceneMaps>& maps, SceneFusionOptions options);

}  // namespace colmap_ext
