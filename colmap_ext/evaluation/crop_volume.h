// The volume of a scene that is scored, as Tanks and Temples gives it: a polygon, extruded along one axis.
#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace colmap_ext {

struct CropVolume {
  int axis = 2;  // of the extrusion: 0 = x, 1 = y, 2 = z, in the truth's frame
  double min = 0, max = 0;
  std::vector<Eigen::Vector2d> polygon;  // the other two coordinates, in their order

  bool Contains(const Eigen::Vector3d& point) const;
};

// Reads the .json that Open3D writes (SelectionPolygonVolume). Throws phi::InputError naming the file.
CropVolume ReadCropVolume(const std::filesystem::path& path);

// Four rows of four numbers: a similarity (rotation, scale and translation). Throws phi::InputError naming the file.
Eigen::Matrix4d ReadSimilarity(const std::filesystem::path& path);

}  // namespace colmap_ext
