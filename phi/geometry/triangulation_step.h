// Gauss and Newton's method on the reprojection errors of one point.
#pragma once

#include <Eigen/Core>

#include "phi/geometry/camera.h"

namespace phi {

// One step of it, to where the point's observations meet.
class TriangulationStep {
 public:
  // in_camera: the point in the camera's frame, z > 0. error: observed less projected, pixels.
  void Add(const Camera& camera, const Eigen::Vector3d& in_camera, const Eigen::Vector2d& error,
           double weight = 1);
  // In the world. damping: a share of the normal matrix's trace that is added to its diagonal, so that a point which its rays
  // hardly fix along them stays where it is in that direction. Not finite where nothing fixes it.
  Eigen::Vector3d Solve(double damping = 0) const;

 private:
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_ = Eigen::Vector3d::Zero();
};

}  // namespace phi
