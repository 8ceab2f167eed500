// How far hypotheses may lie from the depths that sparse points tell (kDepthBounds).
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "phi/cpu/cpu_estimation.h"
#include "phi/matching/estimation_setup.h"
#include "tests/support/exact_scenes.h"

namespace phi {
namespace {

using test_support::RenderedScene;

// A sphere from 3 to 4 units away before a wall, as if sparse points lay on the wall alone.
class DepthBounds : public ::testing::Test {
 protected:
  DepthBounds() {
    input_.depth_min = 5;
    input_.depth_max = 10;
  }

  // Percentage of the sphere's pixels within 1 % of its depth, those nearer than 5 of all.
  struct Score {
    double sphere = 0, nearer = 0;
  };
  Score Estimate() const {
    const PlaneMap map = EstimateOnCpu(input_, StereoOptions()).map;
    const PlaneMap& truth = *scene_.truth[0];
    int num_sphere = 0, num_right = 0, num_nearer = 0;
    for (int y = 0; y < truth.height(); ++y) {
      for (int x = 0; x < truth.width(); ++x) {
        const float depth = truth(x, y).depth;
        num_nearer += map(x, y).depth < 5 ? 1 : 0;
        if (depth > 4) continue;
        ++num_sphere;
        num_right += std::abs(map(x, y).depth - depth) < 0.01f * depth ? 1 : 0;
      }
    }
    return {100.0 * num_right / num_sphere, 100.0 * num_nearer / (truth.width() * truth.height())};
  }

  RenderedScene scene_ = test_support::SphereScene();
  EstimationInput input_ = test_support::InputOf(scene_);
};

TEST_F(DepthBounds, WhatLiesBeforeAllSparsePointsIsFound) {
  const Score score = Estimate();
  RecordProperty("sphere", std::to_string(score.sphere));
  EXPECT_GT(score.sphere, 85);  // its rim is the wall's in part
  EXPECT_EQ(MakeEstimationParameters(input_, StereoOptions()).farthest, 10);
}

TEST_F(DepthBounds, HoldWhereTheUserGivesThem) {
  input_.depth_range_is_given = true;
  EXPECT_EQ(Estimate().nearer, 0);
}

TEST_F(DepthBounds, AreNoneWithoutTheRule) {
  StereoOptions options;
  options.method.rules.Set(Rule::kDepthBounds, 0);
  EXPECT_EQ(MakeEstimationParameters(input_, options).farthest, std::numeric_limits<float>::max());
}

}  // namespace
}  // namespace phi
