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
  // Of a place in K's coordinates; the border belongs to the image.
  bool Contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= width && pixel.y() <= height;
  }
};

Eigen::Matrix3d CalibrationMatrix(const Pinhole& pinhole);

// cam_from_world: X_camera = rotation * X_world + translation. World units are the sparse model's.
// Its arithmetic is in camera.cc: nearly every file reads this header, and Eigen's products cost a second to compile.
struct Pose {
  Eigen::Matrix3d rotation = Unrotated();
  Eigen::Vector3d translation{0, 0, 0};

  Eigen::Vector3d Center() const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& world) const;

 private:
  static Eigen::Matrix3d Unrotated();
};

struct Camera {
  Pinhole pinhole;
  Pose pose;
};

}  // namespace phi
