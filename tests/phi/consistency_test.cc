#include "phi/filtering/consistency.h"

#include <gtest/gtest.h>

#include "phi/filtering/filter_setup.h"
#include "phi/geometry/camera.h"

namespace phi {
namespace {

// Two cameras side by side (baseline 0.5) that look at a fronto-parallel plane at depth 2; f = 100, so one
// pixel of disparity is 0.08 of depth there.
class ConsistencyTest : public ::testing::Test {
 protected:
  ConsistencyTest() {
    reference_.pinhole = {80, 60, 100, 100, 40, 30};
    source_ = reference_;
    source_.pose.translation = {-0.5, 0, 0};
    view_ = MakeRelativeView(reference_, source_);
    k_ = MakeRayModel(reference_.pinhole);
  }

  bool Consistent(float depth, Vec3f normal = {0, 0, -1}) const {
    return IsConsistent(k_, view_, 60.5f, 30.5f, {normal, depth}, map_.view(), thresholds_);
  }

  Camera reference_, source_;
  RelativeView view_;
  RayModel k_;
  PlaneMap map_{80, 60, PlaneHypothesis{{0, 0, -1}, 2.0f}};
  ConsistencyThresholds thresholds_;
};

TEST_F(ConsistencyTest, AcceptsTheSamePlane) { EXPECT_TRUE(Consistent(2.0f)); }

TEST_F(ConsistencyTest, RelativeDepthErrorOfOnePercentIsTheLimit) {
  thresholds_.max_reprojection_error = 10;
  EXPECT_TRUE(Consistent(2.0f * 1.0098f));
  EXPECT_FALSE(Consistent(2.0f * 1.0103f));
  EXPECT_TRUE(Consistent(2.0f * 0.9905f));
}

TEST_F(ConsistencyTest, ReprojectionErrorInPixelsOfTheReference) {
  thresholds_.max_relative_depth_error = 0.5f;
  // Depth d against 2: the match moves by f * b * |1/d - 1/2| = 50 * |1/d - 0.5| pixels.
  EXPECT_TRUE(Consistent(1 / (0.5f + 0.9f / 50)));
  EXPECT_FALSE(Consistent(1 / (0.5f + 1.1f / 50)));
}

TEST_F(ConsistencyTest, NormalsMayDifferByThirtyDegrees) {
  EXPECT_TRUE(Consistent(2.0f, {std::sin(0.50f), 0, -std::cos(0.50f)}));   // 28.6 degrees
  EXPECT_FALSE(Consistent(2.0f, {std::sin(0.55f), 0, -std::cos(0.55f)}));  // 31.5 degrees
}

TEST_F(ConsistencyTest, TriangulationAngle) {
  thresholds_.max_ray_cosine = std::cos(0.20f);  // the angle is about 0.23 radian here
  EXPECT_TRUE(Consistent(2.0f));
  thresholds_.max_ray_cosine = std::cos(0.27f);
  EXPECT_FALSE(Consistent(2.0f));
}

TEST_F(ConsistencyTest, NoDepthInTheSourceOrOutsideOfIt) {
  map_ = PlaneMap(80, 60);
  EXPECT_FALSE(Consistent(2.0f));
  EXPECT_FALSE(IsConsistent(k_, view_, 10.5f, 30.5f, {{0, 0, -1}, 2.0f}, map_.view(), thresholds_));
}

TEST_F(ConsistencyTest, DepthIsNotBlendedAcrossAnEdge) {
  map_ = PlaneMap(80, 60);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) map_(x, y).depth = x < 40 ? 2.0f : 3.0f;
  }
  EXPECT_EQ(InterpolatedDepth(map_.view(), 39.9f, 20.5f), 2.0f);
  EXPECT_EQ(InterpolatedDepth(map_.view(), 40.1f, 20.5f), 3.0f);
}

TEST_F(ConsistencyTest, FilterWantsTwoViewsAndSparesInferredPixelsTheCostTest) {
  SceneView reference{"a", 1, reference_}, source{"b", 2, source_};
  const auto map = std::make_shared<PlaneMap>(map_);
  FilterInput input{{&reference, map}, {{&source, map}}, nullptr, nullptr};
  FilterOptions options;
  EXPECT_FALSE(FilterContext(input, options).Keeps(60, 30));
  input.sources.push_back(input.sources[0]);
  EXPECT_TRUE(FilterContext(input, options).Keeps(60, 30));
  EXPECT_FALSE(FilterContext(input, options).Keeps(10, 30));  // seen by the reference alone

  input.cost = std::make_shared<CostMap>(80, 60, 1.0f);
  options.max_cost = 0.9;
  EXPECT_FALSE(FilterContext(input, options).Keeps(60, 30));
  input.filled = std::make_shared<Mask>(80, 60, kInferredConfirmed);
  EXPECT_TRUE(FilterContext(input, options).Keeps(60, 30));
}

TEST_F(ConsistencyTest, InferredPixelsHaveTheirOwnNumberOfViews) {
  SceneView reference{"a", 1, reference_}, source{"b", 2, source_};
  const auto map = std::make_shared<PlaneMap>(map_);
  FilterInput input{{&reference, map}, {{&source, map}}, nullptr, nullptr};
  FilterOptions options;
  options.min_num_consistent_inferred = 1;
  EXPECT_FALSE(FilterContext(input, options).Keeps(60, 30));
  for (const std::uint8_t value : {kInferredConfirmed, kInferredAlone}) {
    input.filled = std::make_shared<Mask>(80, 60, value);
    EXPECT_TRUE(FilterContext(input, options).Keeps(60, 30));
  }
}

}  // namespace
}  // namespace phi
