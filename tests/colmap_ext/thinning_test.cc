#include "colmap_ext/thinning.h"

#include <gtest/gtest.h>

#include <utility>

namespace colmap_ext {
namespace {

TEST(Thinning, TheLongerSideFitsAndNothingGrows) {
  const auto fitting = [](int width, int height, int longest) {
    const ThinnedSize size = FittingSize(width, height, longest);
    return std::pair(size.width, size.height);
  };
  EXPECT_EQ(fitting(300, 200, 150), std::pair(150, 100));
  EXPECT_EQ(fitting(200, 300, 150), std::pair(100, 150));
  EXPECT_EQ(fitting(300, 200, 400), std::pair(300, 200));
  EXPECT_EQ(fitting(1000, 3, 100), std::pair(100, 1)) << "no side is empty";
}

// Three pixels over ten: their middles are at 10/6, 30/6 and 50/6 of the ten; ten over three: at (i + 1/2) * 3/10.
TEST(Thinning, MiddlesFallIntoTheNearestPixel) {
  const int of_ten[] = {1, 5, 8}, of_three[] = {0, 0, 0, 1, 1, 1, 1, 2, 2, 2};
  for (int i = 0; i < 3; ++i) EXPECT_EQ(NearestPixel(i, 3, 10), of_ten[i]) << i;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(NearestPixel(i, 10, 3), of_three[i]) << i;
  for (int i = 0; i < 7; ++i) EXPECT_EQ(NearestPixel(i, 7, 7), i);
  EXPECT_EQ(NearestPixel(99999, 100000, 50000), 49999) << "beyond 32 bits";
}

}  // namespace
}  // namespace colmap_ext
