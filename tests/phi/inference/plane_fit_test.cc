#include "phi/inference/plane_fit.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace phi {
namespace {

// 7 x 7 pixels, less at the border; on a plane all of them count.
TEST(PlaneFit, AWindowReachesThreePixelsToEachSide) {
  constexpr int kWidth = 12, kHeight = 9;
  Array2D<float> map(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) map(x, y) = 0.5f + 0.0001f * static_cast<float>(x) - 0.0002f * static_cast<float>(y);
  }
  const auto reach = [](int i, int side) { return std::min(i + 3, side - 1) - std::max(i - 3, 0) + 1; };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const InverseDepthPlane plane = FitInverseDepthPlane(map.view(), x, y);
      ASSERT_EQ(plane.count, reach(x, kWidth) * reach(y, kHeight)) << x << ", " << y;
      EXPECT_NEAR(plane.value, map(x, y), 1e-6);
      EXPECT_NEAR(plane.slope_x, 0.0001f, 1e-6);
      EXPECT_NEAR(plane.slope_y, -0.0002f, 1e-6);
    }
  }
  map(5, 4) = 0;
  EXPECT_EQ(FitInverseDepthPlane(map.view(), 6, 4).count, 48) << "a pixel without depth";
}

}  // namespace
}  // namespace phi
