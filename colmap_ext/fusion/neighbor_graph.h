// Which images fusion compares with each other: symmetric, and at most a fixed number for each image, so that the
// work and the memory of one image do not grow with the scene.
#pragma once

#include <vector>

#include "colmap_ext/one_place.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Entry k lists the neighbours of images[k] as positions in `images`, strongest first. Strength is the number of
// shared sparse points; pairs that patch-match.cfg names are neighbours too, and images with hardly any shared points
// get the nearest cameras that look the same way. At most half of an image's neighbours stand at its own place.
using NeighborGraph = std::vector<std::vector<int>>;

// max_neighbors < 0: all others.
NeighborGraph BuildNeighborGraph(const Workspace& workspace, const std::vector<int>& images, const OnePlace& one_place,
                                 int max_neighbors);

// Leaves each image the neighbours that come after it.
void KeepImagesToCome(NeighborGraph* graph);

}  // namespace colmap_ext
