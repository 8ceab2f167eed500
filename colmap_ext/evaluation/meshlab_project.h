// MeshLab projects (.mlp): files of scans with the matrix that takes each to the world. ETH3D's truth comes
// as these.
#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace colmap_ext {

struct MeshLabLayer {
  std::filesystem::path path;
  Eigen::Matrix4d world_from_layer = Eigen::Matrix4d::Identity();
};

// Throws phi::InputError naming the file when it has no layer or a matrix that is no rigid motion.
std::vector<MeshLabLayer> ReadMeshLabProject(const std::filesystem::path& path);

}  // namespace colmap_ext
