#include "phi/initialization.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "phi/matching/random_hypothesis.h"

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

TEST(NearestPointDepthRanges, OnePointPerQuadrant) {
  // The cell with columns and rows 48 to 51 has its centre at (50, 50); the radius is 10 pixels.
  const std::vector<SparseObservation> points = {{45, 45, 1}, {47, 47, 2}, {55, 45, 3},
                                                 {55, 55, 9}, {44, 44, 7}, {50, 61, 100}};
  const DepthRangeMap map = NearestPointDepthRanges(points, 100, 80);
  EXPECT_EQ(map.width(), 25);
  EXPECT_EQ(map.height(), 20);
  // (45, 45) and (44, 44) lie behind (47, 47) in one quadrant; (50, 61) is 11 pixels away.
  EXPECT_EQ(map(12, 12).min, 2);
  EXPECT_EQ(map(12, 12).max, 9);
  EXPECT_EQ(map(0, 0).max, 0);
}

TEST(NearestPointDepthRanges, FewerThanTwoQuadrantsAreUnknown) {
  const DepthRangeMap map = NearestPointDepthRanges({{45, 45, 1}, {47, 47, 2}}, 100, 80);
  EXPECT_EQ(map(12, 12).min, 0);
  EXPECT_EQ(map(12, 12).max, 0);
}

TEST(NearestPointDepthRanges, AgreesWithExhaustiveSearchInAnyOrder) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> u(-3, 313), v(-3, 243), depth(1, 9);
  std::vector<SparseObservation> points;
  for (int k = 0; k < 600; ++k) points.push_back({u(random), v(random), depth(random)});
  const DepthRangeMap map = NearestPointDepthRanges(points, 310, 240);
  std::shuffle(points.begin(), points.end(), random);
  const DepthRangeMap shuffled = NearestPointDepthRanges(points, 310, 240);
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      float nearest[4] = {31 * 31, 31 * 31, 31 * 31, 31 * 31}, depths[4] = {0, 0, 0, 0};
      for (const SparseObservation& p : points) {
        const float du = p.u - (4 * x + 2), dv = p.v - (4 * y + 2);
        const int q = (du >= 0 ? 1 : 0) + (dv >= 0 ? 2 : 0);
        if (du * du + dv * dv < nearest[q]) {
          nearest[q] = du * du + dv * dv;
          depths[q] = p.depth;
        }
      }
      float lo = 100, hi = 0;
      int count = 0;
      for (const float d : depths) {
        if (d == 0) continue;
        ++count;
        lo = std::min(lo, d);
        hi = std::max(hi, d);
      }
      ASSERT_EQ(map(x, y).min, count < 2 ? 0 : lo) << x << " " << y;
      ASSERT_EQ(map(x, y).max, count < 2 ? 0 : hi) << x << " " << y;
      ASSERT_EQ(map(x, y).max, shuffled(x, y).max);
    }
  }
}

class RandomHypothesisTest : public testing::TestWithParam<Formulas> {};

TEST_P(RandomHypothesisTest, StaysInRangeAndFacesTheCamera) {
  const RayModel k{300, 300, 160, 120, 320, 240};
  double sum_cosine = 0, sum_depth = 0, sum_inverse = 0, sum_side = 0;
  int count = 0;
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x, ++count) {
      const PlaneHypothesis h = RandomHypothesis(k, x, y, 2, 10, {3, 4}, GetParam());
      const Vec3f ray = k.Ray(x + 0.5f, y + 0.5f);
      ASSERT_GE(h.depth, 2 - 1e-5f);
      ASSERT_LE(h.depth, 10 + 1e-5f);
      ASSERT_NEAR(Norm(h.normal), 1, 1e-5f);
      ASSERT_LT(Dot(h.normal, ray), 0);
      sum_cosine -= Dot(h.normal, ray) / Norm(ray);
      sum_side += Cross(h.normal, ray).y / Norm(ray);
      sum_depth += h.depth;
      sum_inverse += 1 / h.depth;
    }
  }
  EXPECT_NEAR(sum_side / count, 0, 0.01);
  if (GetParam() == Formulas::kRobust) {
    EXPECT_NEAR(sum_cosine / count, 0.5, 0.005);  // mean height of the half sphere
    EXPECT_NEAR(sum_inverse / count, (1.0 / 2 + 1.0 / 10) / 2, 0.003);
  } else {
    EXPECT_GT(sum_cosine / count, 0.55);  // crowded around the axis
    EXPECT_NEAR(sum_depth / count, 6, 0.05);
  }
}

INSTANTIATE_TEST_SUITE_P(Formulas, RandomHypothesisTest,
                         testing::Values(Formulas::kRobust, Formulas::kPaper));

TEST(RandomHypothesis, DependsOnSeedImageAndPixelOnly) {
  const RayModel k{300, 300, 160, 120, 320, 240};
  const auto draw = [&](std::uint32_t seed, std::uint32_t id, int x) {
    return RandomHypothesis(k, x, 5, 2, 10, {seed, id}, Formulas::kRobust).depth;
  };
  EXPECT_EQ(draw(1, 2, 3), draw(1, 2, 3));
  EXPECT_NE(draw(1, 2, 3), draw(2, 2, 3));
  EXPECT_NE(draw(1, 2, 3), draw(1, 3, 3));
  EXPECT_NE(draw(1, 2, 3), draw(1, 2, 4));
}

}  // namespace
}  // namespace phi
