#include "phi/geometry/camera.h"

namespace phi {

Eigen::Matrix3d Pose::Unrotated() { return Eigen::Matrix3d::Identity(); }

Eigen::Vector3d Pose::Center() const { return -rotation.transpose() * translation; }

Eigen::Vector3d Pose::operator*(const Eigen::Vector3d& world) const { return rotation * world + translation; }

}  // namespace phi
