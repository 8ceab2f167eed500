#include "phi/geometry/device_camera.h"

#include <Eigen/LU>

#include "phi/geometry/camera.h"

namespace phi {
namespace {

Mat3f ToFloat(const Eigen::Matrix3d& m) {
  Mat3f out;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) out.m[3 * r + c] = static_cast<float>(m(r, c));
  }
  return out;
}

Vec3f ToFloat(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

RayModel MakeRayModel(const Pinhole& p) {
  return {static_cast<float>(p.fx),
          static_cast<float>(p.fy),
          static_cast<float>(p.cx),
          static_cast<float>(p.cy),
          p.width,
          p.height};
}

RelativeView MakeRelativeView(const Camera& reference, const Camera& source) {
  const Eigen::Matrix3d rotation = source.pose.rotation * reference.pose.rotation.transpose();
  // From the centres' difference: with a far world origin, subtracting the translations would lose digits
  // twice.
  const Eigen::Vector3d translation = source.pose.rotation * (reference.pose.Center() - source.pose.Center());
  const Eigen::Matrix3d k_source = CalibrationMatrix(source.pinhole);
  RelativeView view;
  view.rotation = ToFloat(rotation);
  view.translation = ToFloat(translation);
  view.a = ToFloat(Eigen::Matrix3d(k_source * rotation * CalibrationMatrix(reference.pinhole).inverse()));
  view.b = ToFloat(Eigen::Vector3d(k_source * translation));
  view.source = MakeRayModel(source.pinhole);
  return view;
}

}  // namespace phi
