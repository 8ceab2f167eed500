#include "phi/sparse_depth.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

// The model's images are 1000 x 800 with f = 1000; the working resolution is half of that.
struct TwoViews {
  std::vector<SceneView> views;
  SparseScene scene{{{1000, 800, 1000, 1000, 500, 400}, {1000, 800, 1000, 1000, 500, 400}}};

  TwoViews() {
    for (int k = 0; k < 2; ++k) {
      SceneView view;
      view.image_id = k + 1;
      view.camera.pinhole = {500, 400, 500, 500, 250, 200};
      view.camera.pose.translation = {-static_cast<double>(k), 0, 0};  // the centre is at x = k
      views.push_back(view);
    }
  }

  // Both views see the point where it is, but for `error` pixels in the first one.
  void Add(const Eigen::Vector3d& world, float error, int track_length = 2) {
    std::vector<PointObservation> track;
    for (int k = 0; k < track_length; ++k) {
      const Eigen::Vector3d p = world - Eigen::Vector3d(k, 0, 0);
      track.push_back({k, static_cast<float>(1000 * p.x() / p.z() + 500) + (k == 0 ? error : 0.0f),
                       static_cast<float>(1000 * p.y() / p.z() + 400)});
    }
    scene.AddPoint(world, track);
  }
};

TEST(SparseDepth, KeepsReliablePointsInWorkingPixels) {
  TwoViews two;
  two.Add({1, 0.5, 10}, 0);
  two.Add({2, 0, 10}, 3.9f);  // mean over two observations: 1.95 pixels
  two.Add({3, 0, 10}, 4.1f);  // 2.05 pixels
  two.Add({0, 0, -10}, 0);    // behind both cameras
  const SparseDepth sparse = SparseDepthSource(two.views, two.scene).ForView(0);
  ASSERT_EQ(sparse.points.size(), 2u);
  EXPECT_FLOAT_EQ(sparse.points[0].u, 250 + 500 * 0.1f);
  EXPECT_FLOAT_EQ(sparse.points[0].v, 200 + 500 * 0.05f);
  EXPECT_FLOAT_EQ(sparse.points[0].depth, 10);
}

TEST(SparseDepth, ShortTracksAreNotReliable) {
  TwoViews two;
  std::vector<PointObservation> one = {{0, 500, 400}};
  for (int k = 0; k < 9; ++k) {
    std::vector<PointObservation> long_track(4, PointObservation{0, 500, 400});
    two.scene.AddPoint({0, 0, 10}, long_track);
  }
  two.scene.AddPoint({0, 0, 10}, one);  // v = 37 / 10, floor(v - 1) = 2
  const SparseDepthSource source(two.views, two.scene);
  EXPECT_EQ(source.min_track_length(), 2);
  EXPECT_EQ(source.ForView(0).points.size(), 9u);
}

TEST(SparseDepth, RangeIgnoresOnePerCentAndAddsAMargin) {
  TwoViews two;
  for (int k = 0; k <= 200; ++k) two.Add({0, 0, 10 + 0.05 * k}, 0);  // depths 10 to 20
  const SparseDepth sparse = SparseDepthSource(two.views, two.scene).ForView(1);
  EXPECT_FLOAT_EQ(sparse.range.min, 10.1f / 2);
  EXPECT_FLOAT_EQ(sparse.range.max, 19.9f * 2);
}

TEST(SparseDepth, AViewWithoutPointsBorrowsItsFrustumsPoints) {
  TwoViews two;
  SceneView third = two.views[1];
  third.image_id = 3;
  third.camera.pose.translation = {0, 0, 5};  // five units behind the first
  two.views.push_back(third);
  SparseScene scene({two.scene.model_pinhole(0), two.scene.model_pinhole(0), two.scene.model_pinhole(0)});
  const std::vector<PointObservation> track = {{0, 500, 400}, {1, 400, 400}};
  for (int k = 0; k < 20; ++k) scene.AddPoint({0, 0, 10}, track);
  for (int k = 0; k < 20; ++k) scene.AddPoint({100, 0, 1}, track);  // outside the third view
  const SparseDepth sparse = SparseDepthSource(two.views, scene).ForView(2);
  EXPECT_TRUE(sparse.points.empty());
  EXPECT_FLOAT_EQ(sparse.range.min, 15 / 2.0f);
  EXPECT_FLOAT_EQ(sparse.range.max, 15 * 2.0f);
}

TEST(SparseDepth, WithoutAnyPointTheBaselinesSetTheRange) {
  const TwoViews two;  // one unit apart
  const DepthRange range = SparseDepthSource(two.views, two.scene).ForView(0).range;
  EXPECT_FLOAT_EQ(range.min, 0.5f);
  EXPECT_FLOAT_EQ(range.max, 50.0f);
}

// The faces of a panorama, whose poses are rounded. Their nearest cameras set ranges of 1e-12 units.
TEST(SparseDepth, CamerasAtOnePlaceSetNoRange) {
  TwoViews two;
  for (int k = 0; k < 5; ++k) {
    two.views.push_back(two.views[0]);
    two.views.back().camera.pose.translation.x() = k * 1e-12;
  }
  const DepthRange range = DepthRangeWithoutOwnPoints(two.views, two.scene, 0);
  EXPECT_FLOAT_EQ(range.min, 0.5f);
  EXPECT_FLOAT_EQ(range.max, 50.0f);
}

}  // namespace
}  // namespace phi
