// Clouds with one point a voxel, as Tanks and Temples compares them.
#pragma once

#include <cstddef>
#include <vector>

#include "phi/base/vec.h"

namespace colmap_ext {

// One point for each occupied voxel of the grid through (0, 0, 0): the mean, in the order in which the voxels first occur.
// working_memory: bytes beside the points and a bit for each; the result does not depend on it.
std::vector<phi::Vec3f> ThinCloud(std::vector<phi::Vec3f> points, double voxel_size,
                                  std::size_t working_memory = std::size_t{1} << 30);

}  // namespace colmap_ext
