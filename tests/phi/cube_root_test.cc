#include "phi/base/cube_root.h"

#include <cmath>

#include <gtest/gtest.h>

namespace phi {
namespace {

TEST(CubeRoot, IsWithinThreeHundredThousandths) {
  for (double x = 1e-9; x < 9; x *= 1.0003) EXPECT_NEAR(CubeRoot(static_cast<float>(x)) / std::cbrt(x), 1, 3e-5) << x;
}

}  // namespace
}  // namespace phi
