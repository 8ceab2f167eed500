// Photos are moved to their points where poses do not fit them (phi/image_corrections.h).
#pragma once

#include <string>

#include "colmap_ext/workspace.h"
#include "phi/image_corrections.h"
#include "phi/options.h"
#include "phi/sparse_scene.h"

namespace colmap_ext {

// What is to be said of poses that do not fit their points, in pixels of the working images; empty where they do. scene: as of
// MoveImages.
std::string PoseWarning(const phi::ImageCorrections& corrections, const phi::SparseScene& scene,
                        const Workspace& workspace);

// Before the workspace's photos are read or its jobs keyed. scene: MakeSparseScene of the workspace's model. Warns where photos
// are moved, since poses that are adjusted to the points are better.
void MoveImages(const phi::SparseScene& scene, const phi::StereoOptions& options, Workspace* workspace);

}  // namespace colmap_ext
