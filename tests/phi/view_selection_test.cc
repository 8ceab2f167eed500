#include "phi/view_selection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "phi/base/cancellation.h"
#include "phi/view_coverage.h"
#include "tests/support/empty_scene.h"

namespace phi {
namespace {

using test_support::EmptyScene;

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

TEST(ViewSelection, CanBeCancelled) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {1, 0, 0})};
  const SparseScene scene = EmptyScene(views);
  CancellationFlag() = true;
  EXPECT_THROW(SelectSourceViews(views, scene, ViewSelectionOptions()), Cancelled);
  CancellationFlag() = false;
  EXPECT_NO_THROW(SelectSourceViews(views, scene, ViewSelectionOptions()));
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
}

TEST(ViewSelection, ThePapersScore) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {1, 0, 0}),
                                        MakeView(3, {0, 1, 0}, 0.02)};
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 4; ++k) AddPoint({0, 1, 2}, {0, 0, 10}, &scene);
  AddPoint({0, 2}, {0.1, 0, 10}, &scene);
  ViewSelectionOptions options;
  options.method.formulas = Formulas::kPaper;
  const auto selected = ViewSelector(views, scene, options).Select(0, 8);
  ASSERT_EQ(selected.size(), 2u);
  EXPECT_EQ(selected[0].view, 1);  // parallel axes: zeta = 0
  EXPECT_DOUBLE_EQ(selected[0].score, 0);
  EXPECT_NEAR(selected[1].score, 0.1 * 0.02 / 5, 1e-9);
}

// A plane of points at depth 10, x from -4 to 4 and y from -3 to 3, seen by all of `seen_by` where `inside` says so.
template <typename Inside>
void AddWall(const std::vector<int>& seen_by, const Inside& inside, SparseScene* scene) {
  for (int row = -6; row <= 6; ++row) {
    for (int column = -8; column <= 8; ++column) {
      const Eigen::Vector3d world(0.5 * column, 0.5 * row, 10);
      if (inside(world)) AddPoint(seen_by, world, scene);
    }
  }
}

bool Anywhere(const Eigen::Vector3d&) { return true; }

TEST(UsefulAngle, IsBestAtAboutTenDegrees) {
  const auto useful = [](double degrees) { return UsefulAngle(static_cast<float>(degrees / kDegrees)); };
  EXPECT_EQ(useful(0), 0);
  EXPECT_NEAR(useful(10), (1 - std::exp(-4.0)) * std::exp(-1.0 / 9), 1e-5);
  EXPECT_GT(useful(10), useful(5));
  EXPECT_GT(useful(10), useful(20));
  EXPECT_LT(useful(1), 0.1 * useful(10));
}

TEST(ViewSelection, PrefersUsefulAnglesAndSharedSurface) {
  // At depth 10: 1, 6, 11 and 31 degrees.
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {0.2, 0, 0}),
                                        MakeView(3, {1, 0, 0}), MakeView(4, {2, 0, 0}),
                                        MakeView(5, {6, 0, 0})};
  SparseScene scene = EmptyScene(views);
  AddWall({0, 1, 2, 3, 4}, Anywhere, &scene);
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 1)), (std::vector<std::uint32_t>{4}));
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 2)), (std::vector<std::uint32_t>{4, 3}));
  ViewSelectionOptions by_paper;
  by_paper.method.rules.Set(Rule::kViewCoverage, 0);  // parallel cameras: its score is 0 for all
  // The first one that sees the points at a degree or more.
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, by_paper).Select(0, 1)), (std::vector<std::uint32_t>{3}));
  // Of a third of the surface the best angle is worth less than a good one of all of it.
  SparseScene shared = EmptyScene(views);
  AddWall(
      {0, 2, 3}, [](const Eigen::Vector3d& p) { return p.x() < -1.4; }, &shared);
  AddWall(
      {0, 2}, [](const Eigen::Vector3d& p) { return p.x() >= -1.4; }, &shared);
  EXPECT_EQ(Ids(views, ViewSelector(views, shared, {}).Select(0, 1)), (std::vector<std::uint32_t>{3}));
}

// The rule in pixels gave other views for the same images at half the size.
TEST(ViewSelection, DoesNotDependOnTheResolution) {
  std::vector<SceneView> views;
  for (int k = 0; k < 9; ++k) views.push_back(MakeView(k + 1, {0.3 * k, 0.1 * (k % 3), 0.2 * k}));
  SparseScene scene = EmptyScene(views);
  AddWall({0, 1, 2, 3, 4, 5, 6, 7, 8}, Anywhere, &scene);
  const auto expected = Ids(views, ViewSelector(views, scene, {}).Select(0, 4));
  ASSERT_EQ(expected.size(), 4u);
  for (SceneView& view : views) view.camera.pinhole = {100, 100, 100, 100, 50, 50};
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 4)), expected);
}

// A camera that walks ahead: the points before it hardly move, those beside it do. The rule in pixels rejected all of
// these (mean displacements of 0.2 % depth below 0.1 pixels) but four.
TEST(ViewSelection, KeepsTheNeighboursOfACameraThatMovesForward) {
  std::vector<SceneView> views;
  for (int k = 0; k < 7; ++k) {
    views.push_back(MakeView(k + 1, {0, 0, 0.25 * k}));
    views.back().camera.pinhole = {100, 100, 100, 100, 50, 50};
  }
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 40; ++k) {
    for (const double side : {-1.0, 1.0})
      AddPoint({0, 1, 2, 3, 4, 5, 6}, {side, 0.2 * (k % 5), 4 + 0.1 * k}, &scene);
  }
  const auto ids = Ids(views, ViewSelector(views, scene, {}).Select(0, 8));
  // The next place ahead is less than a degree away for three points in four.
  EXPECT_EQ(ids.size(), 5u);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 2u), 0);
}

// An orbit in steps of 0.3 degrees: eight neighbours within 3 degrees would be one witness.
TEST(ViewSelection, ViewsFromOneDirectionAreOneWitness) {
  std::vector<SceneView> views;
  for (int k = -60; k <= 60; ++k) {
    const double angle = 0.3 * k / kDegrees;
    views.push_back(MakeView(k + 61, {10 * std::sin(angle), 0, 10 - 10 * std::cos(angle)}, -angle));
  }
  std::vector<int> all(views.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<int>(k);
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 40; ++k) AddPoint(all, {0.05 * (k % 8), 0.05 * (k / 8), 10}, &scene);
  const auto selected = ViewSelector(views, scene, {}).Select(60, 8);
  ASSERT_EQ(selected.size(), 8u);
  std::vector<int> places;
  for (const SourceView& source : selected) places.push_back(source.view);
  std::sort(places.begin(), places.end());
  EXPECT_LT(places.front(), 60 - 30);  // 9 degrees to either side
  EXPECT_GT(places.back(), 60 + 30);
  for (std::size_t i = 1; i < places.size(); ++i)
    EXPECT_GE(places[i] - places[i - 1], 5) << i;  // 1.5 degrees
}

// Six views of the left half at the best angle, two of the right half at a poor one: all of the image counts.
TEST(ViewSelection, CoversTheImage) {
  std::vector<SceneView> views = {MakeView(1, {0, 0, 0})};
  for (int k = 0; k < 6; ++k) views.push_back(MakeView(2 + k, {1.5, 0.8 * (k - 2.5), 0}));
  views.push_back(MakeView(8, {0.4, 0, 0}));
  views.push_back(MakeView(9, {-0.4, 0, 0}));
  SparseScene scene = EmptyScene(views);
  AddWall(
      {0, 1, 2, 3, 4, 5, 6}, [](const Eigen::Vector3d& p) { return p.x() < 0; }, &scene);
  AddWall(
      {0, 7, 8}, [](const Eigen::Vector3d& p) { return p.x() >= 0; }, &scene);
  const auto ids = Ids(views, ViewSelector(views, scene, {}).Select(0, 4));
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 8u), 1);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 9u), 1);
}

TEST(ViewSelection, TakesFewViewsWhereFewAreGood) {
  std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {1, 0, 0}), MakeView(3, {-1, 0, 0}),
                                  MakeView(4, {0, 1, 0}), MakeView(5, {0, -1, 0})};
  // The same places again, a millimetre apart: nothing new.
  for (int k = 1; k <= 4; ++k) {
    views.push_back(MakeView(5 + k, views[k].camera.pose.Center() + Eigen::Vector3d(0.001, 0, 0)));
  }
  SparseScene scene = EmptyScene(views);
  AddWall({0, 1, 2, 3, 4, 5, 6, 7, 8}, Anywhere, &scene);
  const auto selected = ViewSelector(views, scene, {}).Select(0, 8);
  ASSERT_EQ(selected.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE((selected[i].view - 1) % 4, (selected[j].view - 1) % 4);
  }
}

TEST(ViewSelection, RejectsViewsThatShowNoDepth) {
  std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {0.1, 0, 0})};
  for (int k = 1; k <= 4; ++k) views.push_back(MakeView(2 + k, {0, static_cast<double>(k), 0}));
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 20; ++k) AddPoint({0, 1, 2, 3, 4, 5}, {0.1 * k, 0, 10}, &scene);
  // Image 2 sees the points 0.6 degrees apart; the bound is 1.
  const auto ids = Ids(views, ViewSelector(views, scene, {}).Select(0, 8));
  EXPECT_EQ(ids.size(), 4u);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 2u), 0);
}

TEST(ViewSelection, TakesWeakViewsWhenThereAreNoOthers) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {0.1, 0, 0}),
                                        MakeView(3, {0.2, 0, 0}), MakeView(4, {0, 0, 0}, 0.1)};
  SparseScene scene = EmptyScene(views);
  for (int k = 0; k < 20; ++k) AddPoint({0, 1, 2, 3}, {0.1 * k, 0, 10}, &scene);
  // The wider baseline first; image 4 stands where the reference stands, which no rule can repair.
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, {}).Select(0, 8)), (std::vector<std::uint32_t>{3, 2}));
  ViewSelectionOptions options;
  options.method.rules.Set(Rule::kWeakViews, 0);
  EXPECT_EQ(Ids(views, ViewSelector(views, scene, options).Select(0, 8)), (std::vector<std::uint32_t>{3}));
}

// A weak view has a tenth of the bound at least, 0.1 degrees: at 10 units a baseline of 0.01745, at the half of them, where the
// cameras alone look too, half of that.
TEST(ViewSelection, AViewFromTheSamePlaceIsNotEvenAWeakOne) {
  for (const auto& [baseline, num] : {std::pair{0.008, 0u}, {0.019, 1u}}) {
    const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {baseline, 0, 0})};
    SparseScene scene = EmptyScene(views);
    for (int k = 0; k < 20; ++k) AddPoint({0, 1}, {baseline / 2, 0.001 * k, 10}, &scene);
    EXPECT_EQ(ViewSelector(views, scene, {}).Select(0, 8).size(), num) << baseline;
  }
}

// The paper has Eq. 2 and 3 and nothing for images that they leave without source views.
TEST(ViewSelection, ThePaperTakesNoWeakViews) {
  const std::vector<SceneView> views = {MakeView(1, {0, 0, 0}), MakeView(2, {0.1, 0, 0}),
                                        MakeView(3, {0.2, 0, 0})};
  SparseScene scene = EmptyScene(views);
  ViewSelectionOptions options;
  options.method.formulas = Formulas::kPaper;
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
  ASSERT_EQ(expected.size(), 5u);
  EXPECT_EQ(std::min(expected[0], expected[1]), 4u);  // 11 degrees to either side
  EXPECT_EQ(std::max(expected[0], expected[1]), 5u);
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
  EXPECT_EQ(std::count(ids.begin(), ids.end(), 2u), 1);  // the neighbour
  ViewSelectionOptions options;
  options.method.rules.Set(Rule::kWeakViews, 0);
  EXPECT_TRUE(ViewSelector(views, scene, options).Select(0, 4).empty());
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
