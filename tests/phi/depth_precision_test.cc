#include "phi/geometry/depth_precision.h"

#include <gtest/gtest.h>

#include "phi/geometry/camera.h"

namespace phi {
namespace {

// f = 700; sources to the right of the reference.
Camera At(double x) {
  Camera camera;
  camera.pinhole = {1000, 800, 700, 700, 500, 400};
  camera.pose.translation = {-x, 0, 0};
  return camera;
}

float Deviation(const std::vector<double>& baselines, float u, float depth) {
  std::vector<RelativeView> sources;
  for (const double x : baselines) sources.push_back(MakeRelativeView(At(0), At(x)));
  return DepthPrecision(MakeRayModel(At(0).pinhole), sources).RelativeDeviation(u, 400, depth);
}

// A disparity of f b / z pixels changes by itself when the depth changes by all of itself.
TEST(DepthPrecision, IsAShareOfTheDisparity) {
  EXPECT_NEAR(Deviation({0.2}, 700, 2), kMatchDeviation / 70, 1e-7);
  EXPECT_NEAR(Deviation({0.1}, 700, 2), kMatchDeviation / 35, 1e-7);
  EXPECT_NEAR(Deviation({0.1}, 700, 4), kMatchDeviation / 17.5f, 1e-7);
}

TEST(DepthPrecision, OfSeveralViewsIsThatOfATypicalOne) {
  EXPECT_NEAR(Deviation({0.2, 0.2, 0.2}, 700, 2), kMatchDeviation / 70, 1e-7);
  EXPECT_NEAR(Deviation({0.1, 0.7}, 700, 2), kMatchDeviation / (35 * 5), 1e-7);  // sqrt((1 + 49) / 2) = 5
}

// Column 30 at depth 2 lies 35 pixels to the left in the source, outside.
TEST(DepthPrecision, ViewsThatMissThePointTakeNoPart) {
  EXPECT_EQ(Deviation({0.1}, 30, 2), 0);
  EXPECT_NEAR(Deviation({0.1, 0.05}, 30, 2), kMatchDeviation / 17.5f, 1e-7);
  EXPECT_EQ(Deviation({}, 700, 2), 0);
}

// Ahead of a camera that moves forward by 1, the point at 100 pixels from the middle and depth 10 moves: x / (z - 1) with
// x = 10 / 7, so u = 1000 / 9 and du = -u / 9 for all of the depth.
TEST(DepthPrecision, ForwardMotion) {
  Camera ahead = At(0);
  ahead.pose.translation = {0, 0, -1};
  const DepthPrecision precision(MakeRayModel(At(0).pinhole), {MakeRelativeView(At(0), ahead)});
  EXPECT_NEAR(precision.RelativeDeviation(600, 400, 10), kMatchDeviation / (1000.0 / 81), 1e-6);
}

// In maps, where it is wanted: as of each pixel alone, for more pixels than are looked at together.
TEST(DepthPrecision, OfAMapsPixels) {
  const DepthPrecision precision(MakeRayModel(At(0).pinhole), {MakeRelativeView(At(0), At(0.2)), MakeRelativeView(At(0), At(-0.1))});
  PlaneMap map(1000, 3);
  Mask wanted(1000, 3, 255);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 1000; ++x) map(x, y) = {{0, 0, -1}, 2 + 0.001f * static_cast<float>(x)};
  }
  map(7, 1).depth = 0;
  for (const int x : {0, 8, 511, 512}) wanted(x, 2) = 0;
  const Array2D<float> deviations = precision.RelativeDeviations(map, wanted);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 1000; ++x) {
      const bool is_told = wanted(x, y) != 0 && map(x, y).depth > 0;
      const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
      ASSERT_EQ(deviations(x, y), is_told ? precision.RelativeDeviation(u, v, map(x, y).depth) : 0) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace phi
