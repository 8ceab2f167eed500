#include "phi/geometry/triangulation_step.h"

#include <Eigen/Cholesky>

namespace phi {

void TriangulationStep::Add(const Camera& camera, const Eigen::Vector3d& in_camera,
                            const Eigen::Vector2d& error, double weight) {
  const Pinhole& k = camera.pinhole;
  const Eigen::Vector3d& p = in_camera;
  Eigen::Matrix<double, 2, 3> slope;
  slope << k.fx / p.z(), 0, -k.fx * p.x() / (p.z() * p.z()), 0, k.fy / p.z(), -k.fy * p.y() / (p.z() * p.z());
  slope *= camera.pose.rotation;
  normal_ += weight * slope.transpose() * slope;
  right_ += weight * slope.transpose() * error;
}

Eigen::Vector3d TriangulationStep::Solve(double damping) const {
  const Eigen::Matrix3d damped = normal_ + damping * normal_.trace() * Eigen::Matrix3d::Identity();
  return damped.ldlt().solve(right_);
}

}  // namespace phi
