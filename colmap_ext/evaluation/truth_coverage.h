// Which points of a cloud the truth can judge: a laser scan does not cover all that the photos show.
#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "phi/base/vec.h"

namespace colmap_ext {

struct CoverageOptions {
  std::filesystem::path workspace;  // --coverage_workspace_path: its sparse model gives cameras and poses
  std::filesystem::path truth_depth_maps;  // --truth_depth_maps
  double values_per_unit = 1000;           // --truth_depth_scale
};

// True where the point (relative to `origin`, world frame) projects onto a pixel with truth in at least one
// image.
std::vector<bool> CoveredByTruth(const std::vector<phi::Vec3f>& points, const Eigen::Vector3d& origin,
                                 const CoverageOptions& options);

}  // namespace colmap_ext
