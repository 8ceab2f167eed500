// Shares of right points, averaged over voxels so that densely sampled surfaces do not outweigh the others.
#pragma once

#include <cstddef>
#include <vector>

#include "colmap_ext/evaluation/tolerance_class.h"
#include "phi/base/vec.h"

namespace colmap_ext {

struct VoxelAverageOptions {
  double voxel_size = 0.01;                           // world units
  std::size_t working_memory = std::size_t{1} << 30;  // bytes
  // The mean is over the occupied voxels of two grids, the second shifted by half a voxel along each axis, as
  // ETH3D has it. Clouds that were thinned on the first grid already are better off without the second, which
  // weighs their points by chance.
  bool shifted_grid = true;
};

// For each of several verdicts on the same points, indexed by tolerance: in [0, 1]; 0 where no point counts. Fastest where the points of
// a voxel follow one another (curve_order.h).
std::vector<std::vector<double>> AverageOverVoxels(const std::vector<phi::Vec3f>& points,
                                                   const std::vector<std::vector<ToleranceClass>>& verdicts,
                                                   std::size_t num_tolerances, const VoxelAverageOptions& options);

}  // namespace colmap_ext
