#include "colmap_ext/evaluation/cloud_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "colmap_ext/evaluation/nearest_class.h"
#include "colmap_ext/evaluation/space_blocks.h"
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

TEST(NearestClass, AgreesWithEveryPairLookedAt) {
  // 60000 points are more than a block's least number, so several blocks and their margins take part.
  const std::vector<Vec3f> references = RandomPoints(1, 60000, 1.0f);
  const std::vector<Vec3f> queries = RandomPoints(2, 60000, 1.2f);
  const std::vector<double> tolerances{0.01, 0.02, 0.05};
  const std::vector<ToleranceClass> classes = ClassifyByNearest(queries, references, tolerances, 1 << 20);
  for (std::size_t i = 0; i < queries.size(); i += 101) {
    float nearest = 10;
    for (const Vec3f& r : references) nearest = std::min(nearest, phi::Norm(queries[i] - r));
    ToleranceClass expected = 0;
    while (expected < 3 && nearest > tolerances[expected]) ++expected;
    EXPECT_EQ(classes[i], expected) << "query " << i << ", distance " << nearest;
  }
}

TEST(SpaceBlocks, EveryPointIsInOneBlockOfAtMostTheGivenSize) {
  const std::vector<Vec3f> references = RandomPoints(1, 5000, 1.0f);
  const std::vector<Vec3f> queries = RandomPoints(2, 3000, 1.0f);
  const SpaceBlocks blocks = SplitIntoBlocks(queries, references, {500, 0.01f});
  std::size_t num_queries = 0, num_references = 0;
  for (const SpaceBlock& block : blocks.blocks) {
    const std::size_t q = block.query_end - block.query_begin,
                      r = block.reference_end - block.reference_begin;
    EXPECT_LE(q + r, 500u);
    num_queries += q;
    num_references += r;
  }
  EXPECT_EQ(num_queries, 3000u);
  EXPECT_EQ(num_references, 5000u);
  EXPECT_GE(blocks.blocks.size(), 16u);
}

TEST(VoxelAverage, ShiftedGridCountsItsVoxelsToo) {
  // Grid 1: two voxels, shares 1 and 0. Shifted by half a voxel: one voxel with both points, share 1/2.
  const std::vector<Vec3f> points{{0.9f, 0.25f, 0.25f}, {1.1f, 0.25f, 0.25f}};
  EXPECT_THAT(AverageOverVoxels(points, {0, 1}, 1, {1.0}), ElementsAre(0.5));
  // A third point, wrong, in the second voxel: shares 1 and 0, then 1/3: their mean is 4/9.
  EXPECT_THAT(AverageOverVoxels({points[0], points[1], points[1]}, {0, 1, 1}, 1, {1.0}),
              ElementsAre(DoubleNear(4.0 / 9, 1e-12)));
}

TEST(VoxelAverage, DoesNotDependOnTheNumberOfPasses) {
  const std::vector<Vec3f> points = RandomPoints(3, 200000, 1.0f);
  std::vector<ToleranceClass> classes;
  for (const Vec3f& p : points) classes.push_back(p.x < 0.3f ? 0 : p.y < 0.5f ? 1 : 2);
  const std::vector<double> whole = AverageOverVoxels(points, classes, 2, {0.05, std::size_t{1} << 30});
  const std::vector<double> parts = AverageOverVoxels(points, classes, 2, {0.05, std::size_t{1} << 20});
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
