// A bounding box that holds none of the points that fusion found.
#pragma once

#include <filesystem>

#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Throws phi::InputError where points were found, and none of them in options.box, which `path` holds. A box is mostly empty since its
// numbers are another coordinate system's, so it says where the scene lies.
void RequirePointsInBox(const SceneFusionReport& report, const Workspace& workspace, const SceneFusionOptions& options,
                        const std::filesystem::path& path);

}  // namespace colmap_ext
