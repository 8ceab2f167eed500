// What a point says of a pair of views, by hand: cameras of other sizes, whose pixels are not square.
#include "phi/view_samples.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/empty_scene.h"

namespace phi {
namespace {

// Both look along z; the source stands a unit to the right.
class ViewSamplerTest : public ::testing::Test {
 protected:
  ViewSamplerTest() : views_(2) {
    views_[0].camera.pinhole = {1200, 800, 900, 1100, 580, 410};
    views_[1].camera.pinhole = {1000, 600, 700, 840, 500, 300};
    views_[1].camera.pose.translation = {-1, 0, 0};
  }

  std::vector<SceneView> views_;
  const std::vector<Eigen::Vector3d> centers_ = {{0, 0, 0}, {1, 0, 0}};
  const ViewSelectionOptions options_;
};

TEST_F(ViewSamplerTest, APointByHand) {
  SparseScene scene = test_support::EmptyScene(views_);
  const PointObservation track[] = {{0, 0, 0}, {1, 0, 0}};
  scene.AddPoint({0.5, -0.4, 10}, track);
  const std::uint32_t points[] = {0};
  const std::vector<ViewSample> samples = ViewSampler(views_, centers_, options_, 0).FromPoints(scene, points);
  ASSERT_EQ(samples.size(), 1u);
  const ViewSample& sample = samples.front();
  EXPECT_NEAR(sample.u, (900 * 0.05 + 580) / 1200, 1e-6);
  EXPECT_NEAR(sample.v, (1100 * -0.04 + 410) / 800, 1e-6);
  // A pixel is as large as the square of the same area.
  EXPECT_NEAR(sample.log_scale, 0.5 * std::log(700.0 * 840 / (900.0 * 1100)), 1e-6);
  const double norm = std::sqrt(0.25 + 0.16 + 100);
  EXPECT_NEAR(sample.angle, std::acos((-0.25 + 0.16 + 100) / (norm * norm)), 1e-6);
  EXPECT_NEAR((sample.to_source - Eigen::Vector3f(0.5f, 0.4f, -10) / static_cast<float>(norm)).norm(), 0, 1e-6);
  // Farther by a share e along the reference's ray it lies at (-0.5 + 0.5 e, -0.4 (1 + e), 10 (1 + e)) before the source.
  const double e = options_.displacement_epsilon;
  EXPECT_NEAR(sample.displacement, 700 * e / (10 * (1 + e)), 1e-6);
}

TEST_F(ViewSamplerTest, APointBehindEitherCameraSaysNothing) {
  SparseScene scene = test_support::EmptyScene(views_);
  const PointObservation track[] = {{0, 0, 0}, {1, 0, 0}};
  scene.AddPoint({0.5, 0, 10}, track);
  const std::uint32_t points[] = {0};
  for (const int behind : {0, 1}) {
    std::vector<SceneView> views = views_;
    views[behind].camera.pose.translation.z() = -20;
    std::vector<Eigen::Vector3d> centers = centers_;
    centers[behind].z() = 20;
    EXPECT_TRUE(ViewSampler(views, centers, options_, 0).FromPoints(scene, points).empty()) << behind;
  }
}

// Farther along the reference's ray is nearer to a source that looks the other way, and behind it where it is close.
TEST_F(ViewSamplerTest, APointThatEquation1MovesBehindTheSourceSaysNothing) {
  ViewSelectionOptions paper;
  paper.method = Formulas::kPaper;  // the robust rule has no use for such pairs
  paper.displacement_epsilon = 0.002;
  SparseScene scene = test_support::EmptyScene(views_);
  const PointObservation track[] = {{0, 0, 0}, {1, 0, 0}};
  scene.AddPoint({0.5, 0, 10}, track);
  const std::uint32_t points[] = {0};
  for (const auto& [beyond, num] : {std::pair{0.019, 0u}, {0.021, 1u}}) {  // the point moves by 0.02
    const Eigen::Vector3d center(1, 0, 10 + beyond);
    views_[1].camera.pose.rotation = Eigen::Vector3d(-1, 1, -1).asDiagonal();
    views_[1].camera.pose.translation = -views_[1].camera.pose.rotation * center;
    const std::vector<Eigen::Vector3d> centers = {{0, 0, 0}, center};
    EXPECT_EQ(ViewSampler(views_, centers, paper, 0).FromPoints(scene, points).size(), num) << beyond;
  }
}

// Eight columns and six rows, each through the middle of its part of the image, at six depths that grow by equal factors.
TEST_F(ViewSamplerTest, TheFrustumIsSampledEvenly) {
  views_[1].camera.pinhole = {100000, 100000, 900, 900, 50000, 50000};  // sees all of it
  const std::vector<ViewSample> samples = ViewSampler(views_, centers_, options_, 0).FromFrustum(8, 8 * 64);
  ASSERT_EQ(samples.size(), 8u * 6 * 6);
  std::multiset<int> columns, rows;
  for (const ViewSample& sample : samples) {
    const float column = 8 * sample.u - 0.5f, row = 6 * sample.v - 0.5f;
    EXPECT_NEAR(column, std::round(column), 1e-4);
    EXPECT_NEAR(row, std::round(row), 1e-4);
    columns.insert(static_cast<int>(std::lround(column)));
    rows.insert(static_cast<int>(std::lround(row)));
  }
  for (int column = 0; column < 8; ++column) EXPECT_EQ(columns.count(column), 36u) << column;
  for (int row = 0; row < 6; ++row) EXPECT_EQ(rows.count(row), 48u) << row;
}

}  // namespace
}  // namespace phi
