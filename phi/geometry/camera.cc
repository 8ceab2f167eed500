#include "phi/geometry/camera.h"

namespace phi {

Eigen::Matrix3d CalibrationMatrix(const Pinhole& p) {
  Eigen::Matrix3d k;
  k << p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1;
  return k;
}

Eigen::Matrix3d Pose::Unrotated() { return Eigen::Matrix3d::Identity(); }

Eigen::Vector3d Pose::Center() const { return -rotation.transpose() * translation; }

Eigen::Vector3d Pose::operator*(const Eigen::Vector3d& world) const { return rotation * world + translation; }

}  // namespace phi
