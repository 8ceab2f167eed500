// Planes of a region that stand along a direction of the scene.
#pragma once

#include <span>
#include <vector>

#include "phi/inference/anchor_cells.h"
#include "phi/inference/image_plane.h"

namespace phi {

// Those that most of the cells lie on, by their weights, each less what the ones before it took; at most four. `direction`: the
// plane at distance 1 (scene_directions.h).
std::vector<ImagePlane> PlanesAlong(const ImagePlane& direction, std::span<const AnchorCell> cells);

}  // namespace phi
