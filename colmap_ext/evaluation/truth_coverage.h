// Which points of a cloud the truth can judge: a laser scan does not cover all that the photos show.
//
// A surface that was not scanned may lie behind one that was, as other images see it: a wall beside a fountain. Its points meet truth there
// and nowhere else. Who knows which images see a point can tell that from a point that is wrong and lies behind its own pixel's truth.
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
  // The cloud's .vis file (--coverage_by_visibility), or empty. With it, truth that lies more than `hidden_by` (world units) before a point
  // counts in images that see the point alone.
  std::filesystem::path visibility = {};
  double hidden_by = 0;
};

// True where the point (relative to `origin`, world frame) projects onto a pixel with truth in at least one
// image. Throws phi::InputError where no true map belongs to the workspace, and where the visibility is not of so many points.
std::vector<bool> CoveredByTruth(const std::vector<phi::Vec3f>& points, const Eigen::Vector3d& origin,
                                 const CoverageOptions& options);

}  // namespace colmap_ext
