// Planes, homographies and relative cameras against values derived by hand.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "phi/geometry/camera.h"
#include "phi/geometry/device_camera.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {
namespace {

Camera MakeCamera(double fx, double fy, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& center) {
  Camera camera;
  camera.pinhole = {640, 480, fx, fy, 320, 240};
  camera.pose.rotation = rotation;
  camera.pose.translation = -rotation * center;
  return camera;
}

// A fronto-parallel plane at depth 2 and a source camera 0.5 to the right: disparity f * b / z = 100 * 0.5
// / 2.
TEST(PlaneHomography, FrontoParallelPlaneShiftsByDisparity) {
  const Camera reference = MakeCamera(100, 100, Eigen::Matrix3d::Identity(), {0, 0, 0});
  const Camera source = MakeCamera(100, 100, Eigen::Matrix3d::Identity(), {0.5, 0, 0});
  const RayModel k = MakeRayModel(reference.pinhole);
  const PlaneHypothesis h{{0, 0, -1}, 2.0f};
  const Vec3f q = InverseDepthCoefficients(k, 100.5f, 50.5f, h);
  EXPECT_NEAR(q.x, 0, 1e-7);
  EXPECT_NEAR(q.y, 0, 1e-7);
  EXPECT_NEAR(q.z, 0.5, 1e-6);
  const Mat3f m = PlaneHomography(MakeRelativeView(reference, source), q);
  const Vec3f p = m * Vec3f{100.5f, 50.5f, 1};
  EXPECT_NEAR(p.x / p.z, 75.5, 1e-4);
  EXPECT_NEAR(p.y / p.z, 50.5, 1e-4);
}

// Any plane, any pose: the homography agrees with projecting the plane's points in double.
TEST(PlaneHomography, AgreesWithProjectionOfPlanePoints) {
  const Eigen::Matrix3d r0 =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Eigen::Matrix3d r1 =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.5, 2, -1).normalized()).toRotationMatrix();
  // A world a million metres from its origin, as geo-registered ones are.
  const Eigen::Vector3d far(1e6, -2e6, 3e5);
  const Camera reference = MakeCamera(500, 510, r0, far + Eigen::Vector3d(0.1, 0.2, -0.1));
  const Camera source = MakeCamera(480, 490, r1, far + Eigen::Vector3d(0.5, 0.1, 0.2));
  const RayModel k = MakeRayModel(reference.pinhole);
  const Vec3f n = Normalized({0.3f, -0.2f, -1.0f});
  const PlaneHypothesis h{n, 3.0f};
  const float u0 = 200.5f, v0 = 300.5f;
  const Mat3f m =
      PlaneHomography(MakeRelativeView(reference, source), InverseDepthCoefficients(k, u0, v0, h));
  for (const auto& [u, v] : {std::pair{200.5f, 300.5f}, {180.0f, 310.0f}, {250.0f, 280.0f}}) {
    const double depth = PlaneDepthAt(k, h, u0, v0, u, v);
    const Vec3f ray = k.Ray(u, v);
    const Eigen::Vector3d x_world =
        r0.transpose() * (depth * Eigen::Vector3d(ray.x, ray.y, 1) - reference.pose.translation);
    const Eigen::Vector3d x = source.pose * x_world;
    const Vec3f p = m * Vec3f{u, v, 1};
    EXPECT_NEAR(p.x / p.z, 480 * x.x() / x.z() + 320, 5e-3);
    EXPECT_NEAR(p.y / p.z, 490 * x.y() / x.z() + 240, 5e-3);
    // The point is on the plane.
    const Eigen::Vector3d normal(n.x, n.y, n.z);
    const Vec3f ray0 = k.Ray(u0, v0);
    EXPECT_NEAR(depth * normal.dot(Eigen::Vector3d(ray.x, ray.y, 1)),
                3.0 * normal.dot(Eigen::Vector3d(ray0.x, ray0.y, 1)), 1e-5);
  }
}

}  // namespace
}  // namespace phi
