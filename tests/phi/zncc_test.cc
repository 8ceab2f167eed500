#include "phi/matching/zncc.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "phi/matching/cost_aggregation.h"

namespace phi {
namespace {

constexpr Mat3f kIdentity = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};

Array2D<std::uint8_t> Texture(int width, int height, double gain, double offset) {
  Array2D<std::uint8_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image(x, y) = static_cast<std::uint8_t>(std::lround(
          gain * (60 * std::sin(0.7 * x) * std::cos(0.45 * y) + 20 * std::sin(0.31 * x * y)) + offset));
    }
  }
  return image;
}

float Cost(const Array2D<std::uint8_t>& a, const Array2D<std::uint8_t>& b, const Mat3f& h, float u = 32.5f,
           float v = 30.5f) {
  return ZnccCost(GraySampler{a.view()}, GraySampler{b.view()}, MatchingWindow{}, {u, v}, h);
}

TEST(GraySampler, InterpolatesBetweenPixelCentresAndClamps) {
  Array2D<std::uint8_t> image(2, 2);
  image(0, 0) = 10, image(1, 0) = 20, image(0, 1) = 30, image(1, 1) = 80;
  const GraySampler sampler{image.view()};
  EXPECT_FLOAT_EQ(sampler(0.5f, 0.5f), 10);
  EXPECT_FLOAT_EQ(sampler(1.0f, 0.5f), 15);
  EXPECT_FLOAT_EQ(sampler(1.0f, 1.0f), 35);  // mean of the four
  EXPECT_FLOAT_EQ(sampler(-5.0f, 0.5f), 10);
  EXPECT_FLOAT_EQ(sampler(9.0f, 9.0f), 80);
}

TEST(Zncc, ZeroForEqualWindowsAndInvariantToGainAndOffset) {
  const auto image = Texture(64, 64, 1.0, 128);
  EXPECT_NEAR(Cost(image, image, kIdentity), 0, 1e-5);
  EXPECT_NEAR(Cost(image, Texture(64, 64, 0.5, 100), kIdentity), 0, 2e-3);  // rounding to grey levels remains
  EXPECT_NEAR(Cost(image, Texture(64, 64, -1.0, 128), kIdentity), 2, 1e-3);
}

TEST(Zncc, FollowsTheHomography) {
  const auto image = Texture(64, 64, 1.0, 128);
  Array2D<std::uint8_t> shifted(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x)
      shifted(x, y) = image((x + 60) % 64, (y + 2) % 64);  // content moved by (+4, -2)
  }
  const Mat3f translation = {{1, 0, 4, 0, 1, -2, 0, 0, 1}};
  EXPECT_NEAR(Cost(image, shifted, translation), 0, 1e-5);
  EXPECT_GT(Cost(image, shifted, kIdentity), 0.3);
}

TEST(Zncc, MaxCostOutsideTheSourceBehindItOrWithoutTexture) {
  const auto image = Texture(64, 64, 1.0, 128);
  const Mat3f outside = {{1, 0, 30, 0, 1, 0, 0, 0, 1}};
  EXPECT_EQ(Cost(image, image, outside), kMaxCost);
  const Mat3f behind = {{-1, 0, 0, 0, -1, 0, 0, 0, -1}};
  EXPECT_EQ(Cost(image, image, behind), kMaxCost);
  EXPECT_EQ(Cost(image, Array2D<std::uint8_t>(64, 64, 128), kIdentity), kMaxCost);
  EXPECT_EQ(Cost(Array2D<std::uint8_t>(64, 64, 128), image, kIdentity), kMaxCost);
}

TEST(CostAggregation, IgnoresViewsThatDoNotSeeTheWindow) {
  const float costs[] = {0.5f, 0.25f, kMaxCost};
  EXPECT_FLOAT_EQ(CombineCosts(costs, 3, ViewMean::kHarmonic), 2 / (2.0f + 4.0f));
  EXPECT_NEAR(CombineCosts(costs, 3, ViewMean::kCubic), std::cbrt(2 / (8.0f + 64.0f)), 1e-5);
  const float none[] = {kMaxCost, kMaxCost};
  for (const ViewMean mean : {ViewMean::kHarmonic, ViewMean::kCubic}) EXPECT_EQ(CombineCosts(none, 2, mean), kMaxCost);
}

// Two views that see the point and six that something hides, against a wrong depth at which all match alike.
TEST(CostAggregation, CubicMeanFollowsTheViewsThatMatch) {
  const float seen_by_two[] = {0.1f, 0.1f, 0.8f, 0.8f, 0.8f, 0.8f, 0.8f, 0.8f};
  const float wrong[] = {0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f};
  EXPECT_LT(CombineCosts(seen_by_two, 8, ViewMean::kCubic), CombineCosts(wrong, 8, ViewMean::kCubic));
  EXPECT_GT(CombineCosts(seen_by_two, 8, ViewMean::kHarmonic), CombineCosts(wrong, 8, ViewMean::kHarmonic));
  EXPECT_NEAR(CombineCosts(wrong, 8, ViewMean::kCubic), 0.25f, 1e-5);
}

TEST(CostAggregation, ReducedImagesAndThePaperHaveTheHarmonicMean) {
  Rules off;
  off.Set(Rule::kViewMean, 0);
  EXPECT_EQ(ChooseViewMean(Formulas::kRobust, false), ViewMean::kCubic);
  EXPECT_EQ(ChooseViewMean(Formulas::kRobust, true), ViewMean::kHarmonic);
  EXPECT_EQ(ChooseViewMean({Formulas::kRobust, off}, false), ViewMean::kHarmonic);
  EXPECT_EQ(ChooseViewMean(Formulas::kPaper, false), ViewMean::kHarmonic);
}

// On both sides of the centre, and inside the window whatever its size.
TEST(SparseSamples, LieNearTheCentreAndNearTheRim) {
  const auto rows = [](int n) { return std::array{SparseOffset(0, n), SparseOffset(1, n), SparseOffset(2, n), SparseOffset(3, n)}; };
  EXPECT_EQ(rows(5), (std::array{-4, -1, 1, 4}));
  EXPECT_EQ(rows(kMinSideForSparse), (std::array{-3, -1, 1, 3}));
  EXPECT_EQ(rows(32), (std::array{-26, -6, 6, 26}));
}

}  // namespace
}  // namespace phi
