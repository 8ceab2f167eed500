#include "colmap_ext/workspace.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/test_data.h"

namespace colmap_ext {
namespace {

TEST(WorkspaceTest, RealSceneOpensAtHalfTheSize) {
  const auto scene = test_support::FindScene("fountain");
  if (scene.empty()) GTEST_SKIP() << "scene 'fountain' is not there; set PHIMVS_TEST_DATA";
  WorkspaceOptions options;
  options.path = scene / "dense";
  options.max_image_size = 768;
  const Workspace workspace(options);
  ASSERT_EQ(workspace.views().size(), 11u);
  EXPECT_GT(workspace.model().points.size(), 1000u);
  const phi::Pinhole& pinhole = workspace.views()[0].camera.pinhole;
  EXPECT_EQ(pinhole.width, 768);
  EXPECT_EQ(pinhole.height, 512);
  const auto gray = workspace.ReadGray(0);
  EXPECT_EQ(gray->width(), 768);
  EXPECT_EQ(gray->height(), 512);
  // Each point lies in front of the cameras that saw it, and near where they saw it.
  const SparseModel& model = workspace.model();
  const auto& camera = model.cameras.begin()->second;
  int num_checked = 0;
  for (const SparsePoint& point : model.points) {
    for (const TrackElement& element : point.track) {
      const int image = workspace.FindImage(
          std::find_if(model.images.begin(), model.images.end(), [&](const SparseImage& i) {
            return i.image_id == element.image_id;
          })->name);
      const phi::Camera& view = workspace.views()[image].camera;
      const Eigen::Vector3d in_camera = view.pose * point.xyz;
      ASSERT_GT(in_camera.z(), 0);
      const double scale = static_cast<double>(camera.width) / view.pinhole.width;
      const double u = scale * (view.pinhole.fx * in_camera.x() / in_camera.z() + view.pinhole.cx);
      ASSERT_NEAR(u, model.images[image].observations[element.observation_index].x, 8);
      ++num_checked;
    }
  }
  EXPECT_GT(num_checked, 1000);
}

}  // namespace
}  // namespace colmap_ext
