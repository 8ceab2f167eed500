#include "colmap_ext/evaluation/cloud_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "colmap_ext/evaluation/curve_order.h"
#include "colmap_ext/evaluation/nearest_class.h"
#include "colmap_ext/evaluation/voxel.h"
#include "colmap_ext/evaluation/voxel_average.h"
#include "phi/base/error.h"
#include "phi/base/random.h"

namespace colmap_ext {
namespace {

using phi::Vec3f;
using testing::DoubleNear;
using testing::ElementsAre;

// A horizontal square of `side` by `side` points, `spacing` apart, at height z; its corner at (0.003, 0.003).
std::vector<Vec3f> Plane(int side, float spacing, float z) {
  std::vector<Vec3f> points;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) points.push_back({0.003f + x * spacing, 0.003f + y * spacing, z});
  }
  return points;
}

TEST(CloudEvaluation, PlaneAtAKnownOffsetIsRightFromThatOffsetOn) {
  CloudPair clouds;
  clouds.truth = Plane(100, 0.01f, 0.0f);
  clouds.points = Plane(100, 0.01f, 0.03f);
  const CloudScores scores = EvaluateCloud(clouds, {{0.01, 0.02, 0.05, 0.1}});
  EXPECT_THAT(scores.accuracy, ElementsAre(0, 0, 100, 100));
  EXPECT_THAT(scores.completeness, ElementsAre(0, 0, 100, 100));
  EXPECT_THAT(scores.f1, ElementsAre(0, 0, 100, 100));
}

TEST(CloudEvaluation, HalfTheSurfaceIsHalfComplete) {
  CloudPair clouds;
  clouds.truth = Plane(100, 0.01f, 0.0f);
  for (const Vec3f& p : clouds.truth) {
    if (p.x < 0.5f) clouds.points.push_back(p);
  }
  const CloudScores scores = EvaluateCloud(clouds, {{0.005, 0.095}});
  EXPECT_THAT(scores.accuracy, ElementsAre(100, 100));
  // At 0.095 nine more columns (0.503 to 0.583) lie within the tolerance of column 0.493.
  EXPECT_THAT(scores.completeness, ElementsAre(DoubleNear(50, 1e-9), DoubleNear(59, 1e-9)));
  EXPECT_NEAR(scores.f1[0], 2 * 100 * scores.completeness[0] / (100 + scores.completeness[0]), 1e-9);
}

TEST(CloudEvaluation, DenselySampledErrorsWeighNoMoreThanTheirVolume) {
  CloudPair clouds;
  // Voxels of 1: ten with one right point each, one with 990 wrong points in its middle.
  for (int i = 0; i < 10; ++i) clouds.truth.push_back({10.0f * i + 0.25f, 0.25f, 0.25f});
  clouds.points = clouds.truth;
  for (int i = 0; i < 990; ++i) clouds.points.push_back({200.25f, 0.25f, 0.25f});
  CloudEvaluationOptions options{{0.1}};
  options.voxel_size = 1;
  EXPECT_NEAR(EvaluateCloud(clouds, options).accuracy[0], 100.0 * 10 / 11, 1e-9);
}

TEST(CloudEvaluation, PointsThatDoNotCountChangeCompletenessOnly) {
  CloudPair clouds;
  clouds.truth = {{0.25f, 0.25f, 0.25f}, {5.25f, 0.25f, 0.25f}};
  clouds.points = {{0.25f, 0.25f, 0.25f}, {5.25f, 0.25f, 0.25f}, {9.25f, 0.25f, 0.25f}};
  clouds.counted = {true, false, false};
  const CloudScores scores = EvaluateCloud(clouds, {{0.1}});
  EXPECT_EQ(scores.num_counted, 1u);
  EXPECT_THAT(scores.accuracy, ElementsAre(100));
  EXPECT_THAT(scores.completeness, ElementsAre(100));
}

TEST(CloudEvaluation, ScoresMeasuredAndInferredPointsApart) {
  CloudPair clouds;
  clouds.truth = {{0.5f, 0.5f, 0.5f}};
  // One voxel of 1: a measured point at the truth, three inferred ones 0.3 away. Another: an inferred point at
  // 9.5, wrong. A third: one that does not count.
  clouds.points = {{0.5f, 0.5f, 0.5f}, {0.8f, 0.5f, 0.5f}, {0.5f, 0.8f, 0.5f},
                   {0.5f, 0.5f, 0.8f}, {9.5f, 0.5f, 0.5f}, {5.5f, 0.5f, 0.5f}};
  clouds.inferred = {false, true, true, true, true, true};
  clouds.counted = {true, true, true, true, true, false};
  CloudEvaluationOptions options{{0.1, 0.4}};
  options.voxel_size = 1;
  const CloudScores scores = EvaluateCloud(clouds, options);
  EXPECT_THAT(scores.accuracy, ElementsAre(12.5, 50));  // voxels: 1/4 and 0; 1 and 0
  ASSERT_TRUE(scores.measured && scores.inferred);
  EXPECT_EQ(scores.measured->num_counted, 1u);
  EXPECT_THAT(scores.measured->accuracy, ElementsAre(100, 100));
  EXPECT_EQ(scores.inferred->num_counted, 4u);
  EXPECT_THAT(scores.inferred->accuracy, ElementsAre(0, 50));  // voxels: 0 and 0; 3/3 and 0
  EXPECT_THAT(scores.completeness, ElementsAre(100, 100));

  clouds.inferred.clear();
  EXPECT_FALSE(EvaluateCloud(clouds, options).inferred);
}

TEST(CloudEvaluation, EmptyReconstructionScoresZero) {
  CloudPair clouds;
  clouds.truth = Plane(10, 0.01f, 0);
  const CloudScores scores = EvaluateCloud(clouds, {{0.01, 0.1}});
  EXPECT_THAT(scores.f1, ElementsAre(0, 0));
}

TEST(CloudEvaluation, RefusesCloudsBeyondTheMemory) {
  CloudPair clouds;
  clouds.truth = Plane(1000, 0.01f, 0);
  CloudEvaluationOptions options;
  options.memory = 1 << 20;
  EXPECT_THROW(EvaluateCloud(clouds, options), phi::ResourceError);
}

TEST(CloudEvaluationOptions, NamesTheOptionThatIsWrong) {
  EXPECT_EQ(CloudEvaluationOptions().Check(), "");
  EXPECT_THAT((CloudEvaluationOptions{{}}).Check(), testing::HasSubstr("--tolerances"));
  EXPECT_THAT((CloudEvaluationOptions{{0.02, 0.01}}).Check(), testing::HasSubstr("ascending"));
  EXPECT_THAT((CloudEvaluationOptions{{0.02}, 0.0}).Check(), testing::HasSubstr("--voxel_size"));
}

std::vector<Vec3f> RandomPoints(std::uint32_t seed, int count, float size) {
  std::vector<Vec3f> points;
  for (int i = 0; i < count; ++i) {
    const phi::Random4 r = phi::Philox({seed, 0}, i, 0, 0);
    points.push_back({size * phi::UniformFloat(r.v[0]), size * phi::UniformFloat(r.v[1]),
                      size * phi::UniformFloat(r.v[2])});
  }
  return points;
}

constexpr std::size_t kTreeMemory = std::size_t{1} << 30;

std::vector<Vec3f> Ordered(std::vector<Vec3f> points) {
  Reorder(OrderAlong(SpaceCurve(points, 0.01), points, 0, points.size()), 0, points);
  return points;
}

std::vector<ToleranceClass> ClassesByEveryPair(const std::vector<Vec3f>& queries, const std::vector<Vec3f>& references,
                                               const std::vector<double>& tolerances) {
  std::vector<ToleranceClass> classes;
  for (const Vec3f& q : queries) {
    float nearest = 1e9f;
    for (const Vec3f& r : references) nearest = std::min(nearest, phi::Norm(q - r));
    ToleranceClass c = 0;
    while (c < tolerances.size() && nearest > tolerances[c]) ++c;
    classes.push_back(c);
  }
  return classes;
}

TEST(NearestClass, AgreesWithEveryPairLookedAt) {
  const std::vector<double> tolerances{0.01, 0.02, 0.05};
  for (const int num_references : {0, 1, 24, 25, 20000}) {
    const std::vector<Vec3f> references = Ordered(RandomPoints(1, num_references, 1.0f));
    const std::vector<Vec3f> queries = Ordered(RandomPoints(2, 2000, 1.2f));
    std::vector<ToleranceClass> classes(queries.size(), 3);
    LowerToNearest(queries, references, tolerances, kTreeMemory, classes);
    EXPECT_EQ(classes, ClassesByEveryPair(queries, references, tolerances)) << num_references << " references";
  }
}

// More references than a tree of one of several threads, and than so little memory holds trees of.
TEST(NearestClass, SearchesAllPiecesOfManyReferences) {
  const std::vector<Vec3f> references = Ordered(RandomPoints(1, 200000, 1.0f));
  const std::vector<Vec3f> queries = Ordered(RandomPoints(2, 500, 1.2f));
  const std::vector<double> tolerances{0.005, 0.01, 0.02};
  const std::vector<ToleranceClass> expected = ClassesByEveryPair(queries, references, tolerances);
  for (const std::size_t memory : {std::size_t{1}, kTreeMemory}) {
    std::vector<ToleranceClass> classes(queries.size(), 3);
    LowerToNearest(queries, references, tolerances, memory, classes);
    EXPECT_EQ(classes, expected) << memory << " bytes";
  }
}

TEST(NearestClass, DoesNotDependOnTheOrderOfPoints) {
  const std::vector<Vec3f> references = RandomPoints(1, 3000, 1.0f), queries = RandomPoints(2, 1000, 1.2f);
  std::vector<ToleranceClass> classes(queries.size(), 2);
  LowerToNearest(queries, references, {0.02, 0.05}, kTreeMemory, classes);
  EXPECT_EQ(classes, ClassesByEveryPair(queries, references, {0.02, 0.05}));
}

TEST(NearestClass, LowersOnlyWhatIsHigherAndCounts) {
  const std::vector<Vec3f> queries(5, Vec3f{0, 0, 0});
  std::vector<ToleranceClass> classes{0, 1, 2, 3, kNotCounted};
  LowerToNearest(queries, {{0.015f, 0, 0}}, {0.01, 0.02, 0.05}, kTreeMemory, classes);
  EXPECT_THAT(classes, ElementsAre(0, 1, 1, 1, kNotCounted));
}

TEST(NearestClass, ADistanceOfATolerancesSizeIsWithinIt) {
  std::vector<ToleranceClass> classes(3, 2);
  LowerToNearest({{0.25f, 0, 0}, {0, 0.5f, 0}, {0, 0, 0.5000001f}}, {{0, 0, 0}}, {0.25, 0.5}, kTreeMemory, classes);
  EXPECT_THAT(classes, ElementsAre(0, 1, 2));
}

TEST(SpaceCurve, PassesEachVoxelOnce) {
  const std::vector<Vec3f> points = Ordered(RandomPoints(1, 5000, 0.1f));  // 1000 voxels of 0.01
  std::set<Voxel> seen;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Voxel voxel = VoxelOf(points[i], 0.01, 0);
    const bool is_entered = i == 0 || voxel != VoxelOf(points[i - 1], 0.01, 0);
    EXPECT_EQ(seen.insert(voxel).second, is_entered) << "point " << i;
  }
  EXPECT_GT(seen.size(), 900u);
}

TEST(SpaceCurve, PlacesPointsFarOutside) {
  const SpaceCurve curve({{0, 0, 0}, {1, 1, 1}}, 0.01);
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(curve.PlaceOf({-1e30f, -infinity, -5}), curve.PlaceOf({0, 0, 0}));
  EXPECT_GT(curve.PlaceOf({1e30f, infinity, 5}), curve.PlaceOf({1, 1, 1}));
}

// What belongs to a point stays with it.
TEST(CloudEvaluation, DoesNotDependOnTheOrderOfPoints) {
  CloudPair clouds;
  clouds.truth = RandomPoints(1, 3000, 0.5f);
  clouds.points = RandomPoints(2, 2000, 0.5f);
  clouds.truth_left_out = RandomPoints(3, 1000, 0.5f);
  for (std::size_t i = 0; i < clouds.truth.size(); ++i) clouds.truth_views.push_back(clouds.truth[i].x < 0.1f ? 2 : 3);
  for (std::size_t i = 0; i < clouds.points.size(); ++i) {
    clouds.counted.push_back(clouds.points[i].y < 0.3f);
    clouds.inferred.push_back(clouds.points[i].z < 0.2f);
  }
  const CloudEvaluationOptions options{{0.01, 0.03}};
  const CloudScores scores = EvaluateCloud(clouds, options);
  CloudPair reversed = clouds;
  const auto reverse = [](auto&... of) { (std::reverse(of.begin(), of.end()), ...); };
  reverse(reversed.points, reversed.counted, reversed.inferred, reversed.truth, reversed.truth_views, reversed.truth_left_out);
  const CloudScores other = EvaluateCloud(reversed, options);
  EXPECT_EQ(other.accuracy, scores.accuracy);
  EXPECT_EQ(other.accuracy_of_all, scores.accuracy_of_all);
  EXPECT_EQ(other.inferred->accuracy, scores.inferred->accuracy);
  EXPECT_EQ(other.measured->num_counted, scores.measured->num_counted);
  ASSERT_EQ(other.by_views.size(), 2u);
  EXPECT_EQ(other.by_views[0].completeness, scores.by_views[0].completeness);
}

TEST(VoxelAverage, ShiftedGridCountsItsVoxelsToo) {
  // Grid 1: two voxels, shares 1 and 0. Shifted by half a voxel: one voxel with both points, share 1/2.
  const std::vector<Vec3f> points{{0.9f, 0.25f, 0.25f}, {1.1f, 0.25f, 0.25f}};
  EXPECT_THAT(AverageOverVoxels(points, {{0, 1}}, 1, {1.0}), ElementsAre(ElementsAre(0.5)));
  // A third point, wrong, in the second voxel: shares 1 and 0, then 1/3: their mean is 4/9.
  EXPECT_THAT(AverageOverVoxels({points[0], points[1], points[1]}, {{0, 1, 1}}, 1, {1.0}),
              ElementsAre(ElementsAre(DoubleNear(4.0 / 9, 1e-12))));
}

TEST(VoxelAverage, EachVerdictHasItsOwnMean) {
  // Points of a voxel that do not follow one another; in the second verdict one of them does not count.
  const std::vector<Vec3f> points{{0.5f, 0.5f, 0.5f}, {3.5f, 0.5f, 0.5f}, {0.6f, 0.5f, 0.5f}};
  EXPECT_THAT(AverageOverVoxels(points, {{0, 1, 1}, {0, 1, kNotCounted}}, 1, {1.0, 1 << 30, false}),
              ElementsAre(ElementsAre(0.25), ElementsAre(0.5)));
}

TEST(VoxelAverage, DoesNotDependOnTheNumberOfPasses) {
  const std::vector<Vec3f> points = RandomPoints(3, 200000, 1.0f);
  std::vector<ToleranceClass> classes;
  for (const Vec3f& p : points) classes.push_back(p.x < 0.3f ? 0 : p.y < 0.5f ? 1 : 2);
  const std::vector<double> whole = AverageOverVoxels(points, {classes}, 2, {0.05, std::size_t{1} << 30})[0];
  const std::vector<double> parts = AverageOverVoxels(points, {classes}, 2, {0.05, std::size_t{1} << 20})[0];
  EXPECT_NEAR(whole[0], parts[0], 1e-12);
  EXPECT_NEAR(whole[1], parts[1], 1e-12);
  EXPECT_NEAR(whole[0], 0.3, 0.01);
  EXPECT_NEAR(whole[1], 0.3 + 0.7 * 0.5, 0.01);
}

// A scanner at the origin looks along +x at a wall at x = 5: rays every 0.1 mrad, about 0.5 mm apart on the
// wall.
class WallScan : public testing::Test {
 protected:
  WallScan() {
    for (int y = -100; y <= 100; ++y) {
      for (int z = -100; z <= 100; ++z) wall_.push_back({5, 0.0005f * y, 0.0005f * z});
    }
  }

  ToleranceClass Classify(const Vec3f& point) const {
    return ScanBeams(wall_, {0, 0, 0}, {}).Classify(point, {0.01, 0.02, 0.05});
  }

  std::vector<Vec3f> wall_;
};

TEST_F(WallScan, PointNearTheWallIsRight) {
  EXPECT_EQ(Classify({4.995f, 0, 0}), 0);
  // Behind the wall within 2 cm: right there, and at 1 cm nobody saw the place.
  EXPECT_EQ(Classify({5.015f, 0, 0}), 1 | kUnobservedBelow);
}

TEST_F(WallScan, PointInFreeSpaceIsWrong) { EXPECT_EQ(Classify({2.5f, 0, 0}), 3); }

TEST_F(WallScan, PointBehindTheWallIsUnobserved) { EXPECT_EQ(Classify({6, 0, 0}), 3 | kUnobservedBelow); }

TEST_F(WallScan, PointBesideTheBeamsIsUnobserved) {
  // The beams end at y = 0.05 on the wall, 0.025 half way; their radius there is 1.6 mm.
  EXPECT_EQ(Classify({2.5f, 0.026f, 0}), 3);
  EXPECT_EQ(Classify({2.5f, 0.03f, 0}), 3 | kUnobservedBelow);
}

TEST_F(WallScan, PointOnTheOtherSideOfTheScannerIsUnobserved) {
  EXPECT_EQ(Classify({-2.5f, 0, 0}), 3 | kUnobservedBelow);
}

// 0.1 degrees at a range of 10: the beam's radius is 10 tan(0.1 degrees) = 0.01745.
TEST(ScanBeams, WidenByTheirHalfAngle) {
  const ScanBeams beams({{10, 0, 0}}, {0, 0, 0}, {.start_radius = 0, .divergence_half_angle = 0.1});
  EXPECT_EQ(FirstRightTolerance(beams.Classify({10, 0.0165f, 0}, {0.05})), 0);
  EXPECT_EQ(FirstRightTolerance(beams.Classify({10, 0.0184f, 0}, {0.05})), 1);
}

TEST(ScanBeams, LooksAroundThePoleAndAcrossTheSeamOfAzimuth) {
  // Scan points straight above the scanner, and at azimuth pi.
  const ScanBeams above({{0.001f, 0, 4}, {-0.001f, -0.001f, 4}}, {0, 0, 0}, {});
  EXPECT_EQ(above.Classify({0, 0, 2}, {0.01}), 1);
  const ScanBeams seam({{-3, 0.0001f, 0}}, {0, 0, 0}, {});
  EXPECT_EQ(seam.Classify({-1.5f, -0.0003f, 0}, {0.01}), 1);
}

TEST(CloudEvaluation, UnobservedPointsDoNotLowerAccuracy) {
  CloudPair clouds;
  for (int y = -100; y <= 100; ++y) {
    for (int z = -100; z <= 100; ++z) clouds.truth.push_back({5, 0.0005f * y, 0.0005f * z});
  }
  clouds.points = {
      {5.002f, 0.0f, 0.0f}, {6.0f, 0.0f, 0.0f}, {7.0f, 0.0f, 0.0f}};  // one right, two behind the wall
  const CloudEvaluationOptions options{{0.01}};
  EXPECT_NEAR(EvaluateCloud(clouds, options).accuracy[0], 100.0 / 3, 1e-9);
  clouds.scans.emplace_back(clouds.truth, Vec3f{0, 0, 0}, BeamOptions{});
  EXPECT_NEAR(EvaluateCloud(clouds, options).accuracy[0], 100, 1e-9);
}

}  // namespace
}  // namespace colmap_ext
