// Depth between the pixels of a map. Half a pixel more or less fails every test here.
#include <gtest/gtest.h>

#include "phi/filtering/consistency.h"

namespace phi {
namespace {

constexpr int kWidth = 9, kHeight = 7;

// Affine in K's coordinates (u, v): bilinear interpolation gives it exactly, wherever the four pixels around exist.
float Slanted(float u, float v) { return 10 + 0.02f * u - 0.03f * v; }

PlaneMap SlantedMap() {
  PlaneMap map(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) map(x, y) = {{0, 0, -1}, Slanted(x + 0.5f, y + 0.5f)};
  }
  return map;
}

float DepthAt(ArrayView2D<const PlaneHypothesis> map, float u, float v) {
  return InterpolatedDepth(ReadTaps(map, u, v), Formulas::kRobust);
}

TEST(InterpolatedDepth, FollowsASlantedPlaneBetweenThePixels) {
  const PlaneMap map = SlantedMap();
  for (float v = 0.5f; v < kHeight - 0.5f; v += 0.125f) {
    for (float u = 0.5f; u < kWidth - 0.5f; u += 0.125f) {
      ASSERT_NEAR(DepthAt(map.view(), u, v), Slanted(u, v), 2e-5f) << u << ", " << v;
    }
  }
}

// Within half a pixel of the border a tap is missing: the pixel that (u, v) lies in has its say alone.
TEST(InterpolatedDepth, TakesTheNearestPixelAtTheBorder) {
  const PlaneMap map = SlantedMap();
  EXPECT_EQ(DepthAt(map.view(), 0.0f, 3.2f), map(0, 3).depth);
  EXPECT_EQ(DepthAt(map.view(), 0.4f, 3.9f), map(0, 3).depth);
  EXPECT_EQ(DepthAt(map.view(), 8.6f, 3.2f), map(8, 3).depth);
  EXPECT_EQ(DepthAt(map.view(), 4.1f, 6.9f), map(4, 6).depth);
  EXPECT_EQ(DepthAt(map.view(), 4.9f, 0.1f), map(4, 0).depth);
  for (const auto& [u, v] : {std::pair{-0.01f, 3.0f}, {9.0f, 3.0f}, {4.0f, -0.01f}, {4.0f, 7.0f}}) {
    EXPECT_EQ(DepthAt(map.view(), u, v), 0) << u << ", " << v;
  }
}

// Surfaces that differ by more than 1 % are not blended: the pixel that (u, v) lies in decides.
TEST(InterpolatedDepth, BlendsNothingAcrossAnEdge) {
  PlaneMap map(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) map(x, y) = {{0, 0, -1}, x < 4 ? 2.0f : 3.0f};
  }
  EXPECT_EQ(DepthAt(map.view(), 3.99f, 3.5f), 2.0f);
  EXPECT_EQ(DepthAt(map.view(), 4.01f, 3.5f), 3.0f);
  for (const auto& [right, expected] : {std::pair{2.0195f, 2.014625f}, {2.0205f, 2.0205f}}) {
    for (int y = 0; y < kHeight; ++y) map(4, y).depth = right;
    EXPECT_NEAR(DepthAt(map.view(), 4.25f, 3.5f), expected, 1e-6f) << right;
  }
}

TEST(InterpolatedDepth, AHoleIsNoTap) {
  PlaneMap map = SlantedMap();
  map(4, 3) = {};
  EXPECT_EQ(DepthAt(map.view(), 4.1f, 3.9f), 0);                // in the hole
  EXPECT_EQ(DepthAt(map.view(), 3.9f, 3.9f), map(3, 3).depth);  // beside it
  EXPECT_EQ(DepthAt(map.view(), 5.2f, 4.1f), map(5, 4).depth);
  EXPECT_NEAR(DepthAt(map.view(), 5.6f, 4.1f), Slanted(5.6f, 4.1f), 2e-5f);
}

}  // namespace
}  // namespace phi
