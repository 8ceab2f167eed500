#include "phi/image_corrections.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "phi/geometry/triangulation_step.h"
#include "tests/support/empty_scene.h"

namespace phi {
namespace {

using test_support::EmptyScene;

constexpr int kNumViews = 6;
constexpr double kFocal = 1000;

// Six cameras on a line before a hilly wall, 1200 x 800 pixels, f = 1000.
SceneView MakeView(int index) {
  SceneView view;
  view.name = std::to_string(index);
  view.camera.pinhole = {1200, 800, kFocal, kFocal, 600, 400};
  view.camera.pose.translation = -Eigen::Vector3d(0.5 * (index - 2.5), 0.2 * (index % 2), 0);
  return view;
}

std::vector<SceneView> MakeViews() {
  std::vector<SceneView> views;
  for (int i = 0; i < kNumViews; ++i) views.push_back(MakeView(i));
  return views;
}

// Points 4 to 6 units away, observed with noise by every camera that sees them.
SparseScene MakeScene(const std::vector<SceneView>& views, double noise) {
  SparseScene scene = EmptyScene(views);
  std::mt19937 random(0);
  std::uniform_real_distribution<double> x(-4, 4), y(-2.5, 2.5);
  std::normal_distribution<double> off(0, noise);
  for (int i = 0; i < 1500; ++i) {
    const double px = x(random), py = y(random);
    const Eigen::Vector3d world(px, py, 5 + std::sin(2 * px) * std::cos(2 * py));
    std::vector<PointObservation> track;
    for (int view = 0; view < static_cast<int>(views.size()); ++view) {
      const Eigen::Vector2d pixel = views[view].camera.pinhole.Project(views[view].camera.pose * world);
      if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > 1200 || pixel.y() > 800) continue;
      track.push_back(
          {view, static_cast<float>(pixel.x() + off(random)), static_cast<float>(pixel.y() + off(random))});
    }
    if (track.size() >= 2) scene.AddPoint(world, track);
  }
  return scene;
}

// Turned about its centre, by pixels at the image's middle.
SceneView Turned(SceneView view, double pixels_u, double pixels_v) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(pixels_u / kFocal, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(-pixels_v / kFocal, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  view.camera.pose.rotation = turn * view.camera.pose.rotation;
  view.camera.pose.translation = turn * view.camera.pose.translation;
  return view;
}

std::vector<SceneView> TurnedViews(double largest) {
  std::vector<SceneView> views = MakeViews();
  const double pixels[kNumViews][2] = {{1, -0.5},    {-0.7, 0.2}, {0.1, 0.9},
                                       {-0.9, -0.8}, {0.6, 0},    {-0.1, 0.2}};
  for (int i = 0; i < kNumViews; ++i)
    views[i] = Turned(views[i], largest * pixels[i][0], largest * pixels[i][1]);
  return views;
}

// How far an offset lies from the true one, which follows from where the same ray goes in the camera as it was and as it is.
double LargestError(const ImageCorrections& corrections, const std::vector<SceneView>& views) {
  const std::vector<SceneView> truth = MakeViews();
  double largest = 0;
  for (int view = 0; view < kNumViews; ++view) {
    for (const auto& [u, v] :
         {std::pair{600.0, 400.0}, {150.0, 100.0}, {1050.0, 100.0}, {150.0, 700.0}, {1050.0, 700.0}}) {
      const Eigen::Vector3d ray((u - 600) / kFocal, (v - 400) / kFocal, 1);
      const Eigen::Matrix3d back =
          truth[view].camera.pose.rotation * views[view].camera.pose.rotation.transpose();
      const Eigen::Vector2d shown = truth[view].camera.pinhole.Project(back * ray);
      largest = std::max(largest,
                         (corrections.of_view[view].Offset(u, v) - (shown - Eigen::Vector2d(u, v))).norm());
    }
  }
  return largest;
}

TEST(ImageCorrections, PosesThatFitMoveNothing) {
  const std::vector<SceneView> views = MakeViews();
  for (const double noise : {0.0, 0.3, 1.0}) {
    const ImageCorrections corrections = FindImageCorrections(views, MakeScene(views, noise), {});
    EXPECT_TRUE(corrections.of_view.empty()) << noise;
    EXPECT_FALSE(corrections.points_are_others);
    EXPECT_LT(corrections.mean_offset, 0.1) << noise;
  }
}

// A camera turned to the right by two pixels sees points two pixels farther left; the photo shows them where it did, to the right.
TEST(ImageCorrections, OneTurnedCameraByHand) {
  std::vector<SceneView> views = MakeViews();
  const SparseScene scene = MakeScene(views, 0.2);
  views[2] = Turned(views[2], -2, 0);
  ASSERT_NEAR(views[2].camera.pinhole.Project(views[2].camera.pose.rotation * Eigen::Vector3d(0, 0, 1)).x(),
              598, 1e-3);
  const ImageCorrections corrections = FindImageCorrections(views, scene, {});
  ASSERT_EQ(corrections.of_view.size(), views.size());
  EXPECT_NEAR(corrections.of_view[2].Offset(600, 400).x(), 2, 0.3);
  EXPECT_NEAR(corrections.of_view[2].Offset(600, 400).y(), 0, 0.1);
  // Root mean square of one image in six.
  EXPECT_NEAR(corrections.mean_offset, 2 / std::sqrt(6), 0.2);
}

TEST(ImageCorrections, TurnedCamerasAreFoundAtTruePoints) {
  const std::vector<SceneView> views = TurnedViews(1);
  const ImageCorrections corrections = FindImageCorrections(views, MakeScene(MakeViews(), 0.3), {});
  ASSERT_EQ(corrections.of_view.size(), views.size());
  EXPECT_LT(LargestError(corrections, views), 0.25);
}

// Where the rays of a track meet, by Gauss-Newton; shift: what is taken from each observation.
template <typename Shift>
Eigen::Vector3d Triangulate(const std::vector<SceneView>& views, std::span<const PointObservation> track,
                            Eigen::Vector3d point, const Shift& shift) {
  for (int step = 0; step < 5; ++step) {
    TriangulationStep towards;
    for (const PointObservation& seen : track) {
      const Camera& camera = views[seen.view].camera;
      const Eigen::Vector3d p = camera.pose * point;
      towards.Add(camera, p, Eigen::Vector2d(seen.u, seen.v) - shift(seen) - camera.pinhole.Project(p));
    }
    point += towards.Solve();
  }
  return point;
}

// Pixels by which exact rays miss one another, root mean square, once their photos are moved.
double Miss(const std::vector<SceneView>& views, const std::vector<ImageCorrection>& corrections) {
  const SparseScene exact = MakeScene(MakeViews(), 0);
  double sum = 0;
  const auto shift = [&](const PointObservation& seen) -> Eigen::Vector2d {
    if (corrections.empty()) return Eigen::Vector2d::Zero();
    return corrections[seen.view].Offset(seen.u, seen.v);
  };
  for (std::size_t i = 0; i < exact.num_points(); ++i) {
    const Eigen::Vector3d point = Triangulate(views, exact.track(i), exact.point(i), shift);
    for (const PointObservation& seen : exact.track(i)) {
      const Eigen::Vector2d projected =
          views[seen.view].camera.pinhole.Project(views[seen.view].camera.pose * point);
      sum += (Eigen::Vector2d(seen.u, seen.v) - shift(seen) - projected).squaredNorm();
    }
  }
  return std::sqrt(sum / static_cast<double>(exact.num_observations()));
}

// Of given poses, whose points were triangulated by them. What turns of all cameras have in common the points take up, and no one
// can tell; photos match all the same.
TEST(ImageCorrections, PhotosMatchThoughPointsFollowedTheCameras) {
  const std::vector<SceneView> views = TurnedViews(1.5);
  const SparseScene observed = MakeScene(MakeViews(), 0.2);
  SparseScene scene = EmptyScene(views);
  const auto as_it_is = [](const PointObservation&) -> Eigen::Vector2d { return Eigen::Vector2d::Zero(); };
  for (std::size_t i = 0; i < observed.num_points(); ++i) {
    scene.AddPoint(Triangulate(views, observed.track(i), observed.point(i), as_it_is), observed.track(i));
  }
  const ImageCorrections corrections = FindImageCorrections(views, scene, {});
  ASSERT_EQ(corrections.of_view.size(), views.size());
  std::printf("rays miss one another by %.3f pixels, by %.3f once moved\n", Miss(views, {}),
              Miss(views, corrections.of_view));
  EXPECT_GT(Miss(views, {}), 0.4);
  EXPECT_LT(Miss(views, corrections.of_view), 0.06);
}

TEST(ImageCorrections, SmallOnesAndThoseOfReducedImagesAreLeft) {
  const SparseScene scene = MakeScene(MakeViews(), 0.2);
  EXPECT_TRUE(FindImageCorrections(TurnedViews(0.2), scene, {}).of_view.empty());
  EXPECT_FALSE(FindImageCorrections(TurnedViews(0.4), scene, {}).of_view.empty());
  std::vector<SceneView> views = TurnedViews(1);
  const double full = FindImageCorrections(views, scene, {}).mean_offset;
  for (SceneView& view : views) view.camera.pinhole = {300, 200, kFocal / 4, kFocal / 4, 150, 100};
  const ImageCorrections reduced = FindImageCorrections(views, scene, {});
  EXPECT_NEAR(reduced.mean_offset, full / 4, 1e-9);
  EXPECT_TRUE(reduced.of_view.empty());
}

// Beyond 400 images some of them tell whether poses fit; all are corrected.
TEST(ImageCorrections, AllOfManyImagesAreMoved) {
  constexpr int kCopies = 140;  // 840 images: every third is asked
  const std::vector<SceneView> turned = TurnedViews(1);
  const SparseScene small = MakeScene(MakeViews(), 0.2);
  std::vector<SceneView> views;
  for (int copy = 0; copy < kCopies; ++copy) views.insert(views.end(), turned.begin(), turned.end());
  SparseScene scene = EmptyScene(views);
  for (int copy = 0; copy < kCopies; ++copy) {
    for (std::size_t i = 0; i < small.num_points(); i += 20) {
      std::vector<PointObservation> track(small.track(i).begin(), small.track(i).end());
      for (PointObservation& seen : track) seen.view += kNumViews * copy;
      scene.AddPoint(small.point(i), track);
    }
  }
  const ImageCorrections corrections = FindImageCorrections(views, scene, {});
  ASSERT_EQ(corrections.of_view.size(), views.size());
  for (const std::size_t view : {std::size_t{1}, std::size_t{7}, views.size() - 5}) {
    // View 1 of each copy is turned by 0.7 and 0.2 pixels.
    EXPECT_NEAR(corrections.of_view[view].Offset(600, 400).x(), 0.7, 0.15) << view;
    EXPECT_NEAR(corrections.of_view[view].Offset(600, 400).y(), -0.2, 0.15) << view;
  }
}

TEST(ImageCorrections, PointsOfOtherCamerasMoveNothing) {
  const ImageCorrections corrections = FindImageCorrections(TurnedViews(60), MakeScene(MakeViews(), 0.2), {});
  EXPECT_TRUE(corrections.points_are_others);
  EXPECT_TRUE(corrections.of_view.empty());
}

TEST(ImageCorrections, AreOfTheRobustFormAndItsRule) {
  const std::vector<SceneView> views = TurnedViews(1);
  const SparseScene scene = MakeScene(MakeViews(), 0.2);
  EXPECT_FALSE(FindImageCorrections(views, scene, {}).of_view.empty());
  EXPECT_TRUE(FindImageCorrections(views, scene, Formulas::kPaper).of_view.empty());
  Rules rules;
  rules.Set(Rule::kImageCorrections, 0);
  EXPECT_TRUE(FindImageCorrections(views, scene, {Formulas::kRobust, rules}).of_view.empty());
  rules.Set(Rule::kImageCorrections, 10);
  EXPECT_TRUE(FindImageCorrections(views, scene, {Formulas::kRobust, rules}).of_view.empty());
}

// Beside a camera, or seen at no number: they say nothing, and spoil nothing.
TEST(ImageCorrections, SinglePointsFarOffChangeNothing) {
  const std::vector<SceneView> views = TurnedViews(1);
  SparseScene scene = MakeScene(MakeViews(), 0.2);
  const ImageCorrections before = FindImageCorrections(views, scene, {});
  const Eigen::Vector3d beside = views[0].camera.pose.rotation.transpose() *
                                 (Eigen::Vector3d(1, 1, 1e-300) - views[0].camera.pose.translation);
  scene.AddPoint(beside, std::vector<PointObservation>{{0, 10, 10}, {1, 700, 10}});
  scene.AddPoint({0, 0, 5}, std::vector<PointObservation>{{2, NAN, 10}, {3, 700, 10}});
  const ImageCorrections after = FindImageCorrections(views, scene, {});
  ASSERT_EQ(after.of_view.size(), views.size());
  for (std::size_t view = 0; view < views.size(); ++view) {
    EXPECT_LT((after.of_view[view].Offset(300, 300) - before.of_view[view].Offset(300, 300)).norm(), 0.01)
        << view;
  }
}

TEST(ImageCorrections, WithoutPointsThereAreNone) {
  const std::vector<SceneView> views = MakeViews();
  SparseScene scene = EmptyScene(views);
  EXPECT_TRUE(FindImageCorrections(views, scene, {}).of_view.empty());
  // Seen by one view, and behind the cameras.
  scene.AddPoint({0, 0, 5}, std::vector<PointObservation>{{0, 10, 10}});
  scene.AddPoint({0, 0, -5}, std::vector<PointObservation>{{0, 10, 10}, {1, 700, 10}});
  EXPECT_TRUE(FindImageCorrections(views, scene, {}).of_view.empty());
}

}  // namespace
}  // namespace phi
