// Scenes as arrays: as phimvs/scene.py hands them over, and as a workspace holds them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/workspace.h"
#include "python/bindings/numpy_arrays.h"

namespace phimvs_python {

using Bytes = Input<std::uint8_t>;
using Doubles = Input<double>;

// A scene as phimvs/scene.py hands it over, checked.
struct Scene {
  std::vector<std::string> names;
  std::vector<std::uint32_t> ids;
  std::vector<std::pair<int, int>> sizes;           // width, height of the photos
  Doubles cameras;                                  // N x 4: fx, fy, cx, cy
  Doubles poses;                                    // N x 4 x 4: cam_from_world
  std::vector<std::optional<Bytes>> images;         // H x W or H x W x 3; none: black
  std::vector<std::optional<Bytes>> masks;          // H x W; 0 leaves a pixel out
  Doubles points;                                   // P x 3, world
  Doubles observations;                             // M x 4: index of the point, index of the image, u, v; by point
};

// The scene at full size, or reduced to max_image_size pixels. Throws as the workspace's constructor.
colmap_ext::Workspace WorkspaceOf(const Scene& scene, int max_image_size);

}  // namespace phimvs_python
