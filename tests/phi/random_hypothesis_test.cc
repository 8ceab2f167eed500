#include "phi/matching/random_hypothesis.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

class RandomHypothesisTest : public testing::TestWithParam<Formulas> {};

TEST_P(RandomHypothesisTest, StaysInRangeAndFacesTheCamera) {
  const RayModel k{300, 300, 160, 120, 320, 240};
  double sum_cosine = 0, sum_depth = 0, sum_inverse = 0, sum_side = 0;
  int count = 0;
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x, ++count) {
      const PlaneHypothesis h = RandomHypothesis(k, x, y, {2, 10}, {3, 4}, GetParam());
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
    return RandomHypothesis(k, x, 5, {2, 10}, {seed, id}, Formulas::kRobust).depth;
  };
  EXPECT_EQ(draw(1, 2, 3), draw(1, 2, 3));
  EXPECT_NE(draw(1, 2, 3), draw(2, 2, 3));
  EXPECT_NE(draw(1, 2, 3), draw(1, 3, 3));
  EXPECT_NE(draw(1, 2, 3), draw(1, 2, 4));
}

}  // namespace
}  // namespace phi
