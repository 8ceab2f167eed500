// The exact scenes against geometry worked out by hand.
#include "tests/support/exact_scenes.h"

#include <cmath>

#include <gtest/gtest.h>

namespace {

using test_support::ExactSceneOptions;
using test_support::PlaneScene;
using test_support::RenderedScene;
using test_support::SphereScene;

// A principal point at a pixel centre and round numbers, so that a ray can be written down.
ExactSceneOptions RoundCamera() {
  ExactSceneOptions options;
  options.width = 100;
  options.height = 80;
  options.focal = 100;
  return options;  // cx = 53, cy = 38, fy = 102
}

TEST(PlaneScene, DepthOfAKnownRay) {
  const RenderedScene scene = PlaneScene(RoundCamera(), {0, 3, -4});  // 3 y - 4 z = -16 through (0, 0, 4)
  const phi::PlaneMap& map = *scene.truth[0];
  // Pixel (52, 48): ray ((52.5 - 53) / 100, (48.5 - 38) / 102, 1); z (3 ray_y - 4) = -16.
  const double ray_y = 10.5 / 102;
  EXPECT_NEAR(map(52, 48).depth, 16 / (4 - 3 * ray_y), 1e-6);
  EXPECT_NEAR(map(52, 48).normal.x, 0, 1e-6);
  EXPECT_NEAR(map(52, 48).normal.y, 0.6, 1e-6);
  EXPECT_NEAR(map(52, 48).normal.z, -0.8, 1e-6);
  EXPECT_EQ((*scene.textured[0])(52, 48), 255);
}

TEST(SphereScene, DepthOfAKnownRayAndOfTheWall) {
  ExactSceneOptions options = RoundCamera();
  const RenderedScene scene = SphereScene(options, 1);
  // Ray through the middle of pixel (53, 38): offset half a pixel, ((0.5) / 100, 0.5 / 102, 1).
  const Eigen::Vector3d ray(0.005, 0.5 / 102, 1);
  const double a = ray.squaredNorm(), b = -4, c = 15;  // |z ray - (0, 0, 4)| = 1
  EXPECT_NEAR((*scene.truth[0])(53, 38).depth, (4 - std::sqrt(b * b - a * c)) / a, 1e-6);
  EXPECT_NEAR((*scene.truth[0])(53, 38).depth, 3, 1e-3);
  EXPECT_EQ((*scene.truth[0])(0, 0).depth, 6);
  EXPECT_NE((*scene.surfaces[0])(0, 0), (*scene.surfaces[0])(53, 38));
}

TEST(SphereScene, NormalsAreUnitAndFaceTheCamera) {
  const RenderedScene scene = SphereScene();
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const phi::RayModel k = phi::MakeRayModel(scene.views[i].camera.pinhole);
    const phi::PlaneMap& map = *scene.truth[i];
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x < map.width(); ++x) {
        const phi::PlaneHypothesis& h = map(x, y);
        ASSERT_GT(h.depth, 0);
        ASSERT_NEAR(phi::Norm(h.normal), 1, 1e-5);
        ASSERT_LT(phi::Dot(h.normal, k.Ray(x + 0.5f, y + 0.5f)), 0);
      }
    }
  }
}

// The homography of the true plane takes a reference pixel to where the source sees the same brightness.
TEST(PlaneScene, ImagesAgreeUnderTheTrueHomography) {
  const RenderedScene scene = PlaneScene();
  const phi::RayModel k = phi::MakeRayModel(scene.views[0].camera.pinhole);
  for (std::size_t j = 1; j < scene.views.size(); ++j) {
    const phi::RelativeView view = phi::MakeRelativeView(scene.views[0].camera, scene.views[j].camera);
    double sum = 0, shuffled = 0;
    int count = 0;
    for (int y = 10; y < 110; y += 3) {
      for (int x = 10; x < 150; x += 3) {
        const phi::Vec3f q = phi::InverseDepthCoefficients(k, x + 0.5f, y + 0.5f, (*scene.truth[0])(x, y));
        const phi::Vec3f p = phi::PlaneHomography(view, q) * phi::Vec3f{x + 0.5f, y + 0.5f, 1};
        const double u = p.x / p.z - 0.5, v = p.y / p.z - 0.5;  // array coordinates
        const int xs = static_cast<int>(std::floor(u)), ys = static_cast<int>(std::floor(v));
        const phi::GrayImage& image = *scene.images[j];
        if (xs < 0 || ys < 0 || xs + 1 >= image.width() || ys + 1 >= image.height()) continue;
        const double wx = u - xs, wy = v - ys;
        const double sample = (1 - wy) * ((1 - wx) * image(xs, ys) + wx * image(xs + 1, ys)) +
                              wy * ((1 - wx) * image(xs, ys + 1) + wx * image(xs + 1, ys + 1));
        sum += std::abs(sample - (*scene.images[0])(x, y));
        shuffled += std::abs(sample - (*scene.images[0])(159 - x, y));
        ++count;
      }
    }
    ASSERT_GT(count, 1000);
    EXPECT_LT(sum / count, 5) << "view " << j;  // interpolation of a texture near the pixel limit
    EXPECT_GT(shuffled / count, 15) << "the texture must have contrast";
  }
}

TEST(RenderedScene, MovedWorldKeepsProjectionsAndScalesDepth) {
  const RenderedScene before = SphereScene();
  RenderedScene after = before;
  colmap_ext::Similarity motion;
  motion.scale = 2.5;
  motion.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  motion.translation = {10, -20, 30};
  colmap_ext::Transform(motion, &after);
  const Eigen::Vector3d world(0.1, 0.2, 3.3);
  for (std::size_t i = 0; i < before.views.size(); ++i) {
    const Eigen::Vector3d p = colmap_ext::Project(before.views[i].camera, world);
    const Eigen::Vector3d q = colmap_ext::Project(after.views[i].camera, motion * world);
    EXPECT_NEAR((p - Eigen::Vector3d(q.x(), q.y(), q.z() / 2.5)).norm(), 0, 1e-9);
    EXPECT_FLOAT_EQ((*after.truth[i])(5, 7).depth, 2.5f * (*before.truth[i])(5, 7).depth);
  }
}

}  // namespace
