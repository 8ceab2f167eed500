// Pinhole cameras. Frames: world -> camera by cam_from_world, x right, y down, z forward (COLMAP's
// convention).
//
// Pixels: array element (column, row) has its centre at (column + 0.5, row + 0.5) in K's coordinates.
#pragma once

#include <Eigen/Core>

namespace phi {

// Intrinsics in pixels, in double.
struct Pinhole {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;

  // Of a point in the camera's frame, before the camera (z > 0).
  Eigen::Vector2d Project(const Eigen::Vector3d& p) const {
    return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy};
  }
};

// cam_from_world: X_camera = rotation * X_world + translation. World units are the sparse model's.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d Center() const { return -rotation.transpose() * translation; }
  Eigen::Vector3d operator*(const Eigen::Vector3d& world) const { return rotation * world + translation; }
};

struct Camera {
  Pinhole pinhole;
  Pose pose;
};

}  // namespace phi
