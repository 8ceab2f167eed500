#include "phi/view_selection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

namespace phi {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// A camera at `center`, turned by `yaw` radians about its y axis (0: looks along +z), f = 1000, 1000 x 1000
// pixels.
SceneView MakeView(std::uint32_t id, const Eigen::Vector3d& center, double yaw = 0) {
  SceneView view;
  view.name = "view" + std::to_string(id);
  view.image_id = id;
  view.camera.pinhole = {1000, 1000, 1000, 1000, 500, 500};
  view.camera.pose.rotation = Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  view.camera.pose.translation = -view.camera.pose.rotation * center;
  return view;
}

SparseScene EmptyScene(const std::vector<SceneView>& views) {
  std::vector<Pinhole> pinholes;
  for (const SceneView& view : views) pinholes.push_back(view.camera.pinhole);
  return SparseScene(pinholes);
}

void AddPoint(const std::vector<int>& views, const Eigen::Vector3d& world, SparseScene* scene) {
  std::vector<PointObservation> track;
  for (const int view : views) track.push_back({view, 0, 0});
  scene->AddPoint(world, track);
}

std::vector<std::uint32_t> Ids(const std::vector<SceneView>& views, const std::vector<SourceView>& selected) {
  std::vector<std::uint32_t> ids;
  for (const SourceView& source : selected) ids.push_back(views[source.view].image_id);
  return ids;
}

// One point straight ahead at depth 10, one source at a baseline of 1: everything follows by hand.
TEST(ViewSelection, DisplacementAndAngleOfOnePair) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {1, 0, 0})};
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 3; ++k) AddPoint({0, 1}, {0, 0, 10}, &scene);
  const auto selected = ViewSelector(views, scene, ViewSelectionOptions()).Select(0, 8);
  ASSERT_EQ(selected.size(), 1u);
  EXPECT_EQ(selected[0].num_shared_points, 3);
  // The source sees the point at u - cx = -1000 / 10 and the moved one at -1000 / 10.02.
  EXPECT_NEAR(selected[0].displacement, 100 - 100 / 1.002, 1e-4);
  EXPECT_NEAR(selected[0].triangulation_angle, std::atan(0.1) * kDegrees, 1e-4);
  // b is the median itself, the distances are 10 and sqrt(101) but depths along the axis are both 10.
  EXPECT_NEAR(selected[0].score, 1.0 * std::atan(0.1) / 3, 1e-6);
}

TEST(ViewSelection, ThePapersScore) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {1, 0, 0}),
                                        MakeView(3, {0, 1, 0}, 0.02)};
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 4; ++k) AddPoint({0, 1, 2}, {0, 0, 10}, &scene);
  AddPoint({0, 2}, {0.1, 0, 10}, &scene);
  ViewSelectionOptions options;
  options.formulas = Formulas::kPaper;
  const auto selected = ViewSelector(views, scene, options).Select(0, 8);
  ASSERT_EQ(selected.size(), 2u);
  EXPECT_EQ(selected[0].view, 1);  // parallel axes: zeta = 0
  EXPECT_DOUBLE_EQ(selected[0].score, 0);
  EXPECT_NEAR(selected[1].score, 0.1 * 0.02 / 5, 1e-9);
}

TEST(ViewSelection, PrefersNearViewsAndManySharedPoints) {
  std::vector<SceneView> views = {MakeView(1, {0, 0, 0})};
  for (int k = 1; k <= 4; ++k) views.push_back(MakeView(1 + k, {static_cast<double>(k), 0, 0}));
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 20; ++k) AddPoint({0, 1, 2, 3, 4}, {0.1 * k, 0, 10}, &scene);
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 8)),
            (std::vector<std::uint32_t>{2, 3, 4, 5}));
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 2)), (std::vector<std::uint32_t>{2, 3}));
  // At baseline 2 the score is about four times that of baseline 1, so six times the points put it first.
  for (int k = 0; k < 100; ++k) AddPoint({0, 2}, {0.1 * (k % 20), 0.1, 10}, &scene);
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 1)), (std::vector<std::uint32_t>{3}));
}

TEST(ViewSelection, RejectsViewsThatShowNoDepth) {
  std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {0.2, 0, 0})};
  for (int k = 1; k <= 4; ++k) views.push_back(MakeView(2 + k, {0, static_cast<double>(k), 0}));
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 20; ++k) AddPoint({0, 1, 2, 3, 4, 5}, {0.1 * k, 0, 10}, &scene);
  // tau of image 2 is 20 pixels * 0.002 = 0.04 < 0.1.
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 8)),
            (std::vector<std::uint32_t>{3, 4, 5, 6}));
}

TEST(ViewSelection, TakesWeakViewsWhenThereAreNoOthers) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {0.1, 0, 0}),
                                        MakeView(3, {0.2, 0, 0}), MakeView(4, {0, 0, 0}, 0.1)};
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 20; ++k) AddPoint({0, 1, 2, 3}, {0.1 * k, 0, 10}, &scene);
  // The wider baseline first; image 4 stands where the reference stands, which no rule can repair.
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 8)), (std::vector<std::uint32_t>{3, 2}));
}

// The paper has Eq. 2 and 3 and nothing for images that they leave without source views.
TEST(ViewSelection, ThePaperTakesNoWeakViews) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {0.1, 0, 0}),
                                        MakeView(3, {0.2, 0, 0})};
  SparseScene scene = EmptyScene(views);
  ViewSelectionOptions options;
  options.formulas = Formulas::kPaper;
  EXPECT_TRUE(ViewSelector(views, scene, options).Select(0, 8).empty());  // no points
  for (int k = 0; k < 20; ++k) AddPoint({0, 1, 2}, {0.1 * k, 0, 10}, &scene);
  EXPECT_TRUE(ViewSelector(views, scene, options).Select(0, 8).empty());  // tau is 0.02 and 0.04 pixels
}

TEST(ViewSelection, DoesNotDependOnTheOrderOfViewsOrTheOriginOfTheWorld) {
  const auto select = [](const std::vector<int>& order, const Eigen::Vector3d& offset) {
    std::vector<SceneView> views;
    std::vector<int> index_of(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      // Images 2 k and 2 k + 1 stand left and right of image 1 at equal distances: ties.
      const int id = order[k] + 1;
      const double side = id == 1 ? 0 : (id % 2 == 0 ? -1.0 : 1.0) * (id / 2);
      views.push_back(MakeView(id, offset + Eigen::Vector3d(side, 0, 0)));
      index_of[order[k]] = static_cast<int>(k);
    }
    SparseScene scene = EmptyScene(views);
    for (int k = -9; k <= 9; ++k) AddPoint(index_of, offset + Eigen::Vector3d(0.1 * k, 0, 10), &scene);
    return Ids(views, ViewSelector(views, scene, {}).Select(index_of[0], 5));
  };
  const auto expected = select({0, 1, 2, 3, 4, 5, 6}, {0, 0, 0});
  EXPECT_EQ(expected, (std::vector<std::uint32_t>{2, 3, 4, 5, 6}));
  EXPECT_EQ(select({6, 2, 0, 5, 1, 4, 3}, {0, 0, 0}), expected);
  EXPECT_EQ(select({6, 2, 0, 5, 1, 4, 3}, {1 << 20, -(1 << 20), 1 << 10}), expected);
}

TEST(ViewSelection, PointsSeenAtTooWideAnAngleDoNotCount) {
  // Seen from x = 0 and x = 20 at depth 10, the point is 63 degrees apart; from x = 16, 58 degrees.
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {20, 0, 0}),
                                        MakeView(3, {16, 0, 0})};
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 10; ++k) AddPoint({0, 1, 2}, {0, 0, 10}, &scene);
  const auto selected = ViewSelector(views, scene, {}).Select(0, 1);
  ASSERT_EQ(selected.size(), 1u);
  EXPECT_EQ(selected[0].view, 2);
  for (const SourceView& source : ViewSelector(views, scene, {}).Select(0, 8)) {
    if (source.view == 1) {
      EXPECT_EQ(source.num_shared_points, 0);
    }
  }
}

// 10,000 views along a street: a pair costs only what it shares.
TEST(ViewSelection, ScalesToLargeScenes) {
  std::vector<SceneView> views;
  for (int k = 0; k < 10000; ++k) views.push_back(MakeView(k + 1, {static_cast<double>(k), 0, 0}));
  SparseScene scene = EmptyScene(views);
  for (int k = 2; k < 9998; ++k) {
    for (int p = 0; p < 20; ++p) AddPoint({k - 2, k - 1, k, k + 1, k + 2}, {k + 0.05 * p, 0, 10}, &scene);
  }
  const auto selected = SelectSourceViews(views, scene, {});
  const auto neighbours = Ids(views, selected[5000]);
  ASSERT_EQ(neighbours.size(), 8u);
  for (const std::uint32_t id : neighbours) EXPECT_LE(std::abs(static_cast<int>(id) - 5001), 4);
}

TEST(ViewSelection, WithoutPointsTheCamerasDecide) {
  std::vector<SceneView> views;
  for (int k = 0; k < 8; ++k) views.push_back(MakeView(k + 1, {0.5 * k, 0, 0}));
  views.push_back(MakeView(9, {0.1, 0, 0}, std::numbers::pi));  // looks the other way
  const SparseScene scene = EmptyScene(views);
  const auto ids = Ids(views, ViewSelector(views, scene, {}).Select(0, 4));
  ASSERT_EQ(ids.size(), 4u);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 9u), 0);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 8u), 0);  // the farthest
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 2u), 1);  // the neighbour
}

TEST(ViewSelection, ATrackThatNamesAViewTwiceCountsOnce) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {1, 0, 0})};
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 3; ++k) AddPoint({1, 0, 1, 0}, {0, 0, 10}, &scene);
  const auto selected = ViewSelector(views, scene, {}).Select(0, 8);
  ASSERT_EQ(selected.size(), 1u);
  EXPECT_EQ(selected[0].num_shared_points, 3);
}

}  // namespace
}  // namespace phi
