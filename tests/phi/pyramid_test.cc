#include "phi/matching/pyramid.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace phi {
namespace {

// Means of four are rounded to the nearest grey level, halves up: always down, every level would darken by 3/8 of one.
TEST(HalveImage, RoundsToTheNearestGreyLevel) {
  GrayImage image(10, 2, 10);
  for (int sum = 0; sum < 5; ++sum) {  // by blocks of 2 x 2
    for (int k = 0; k < sum && k < 4; ++k) image(2 * sum + k % 2, k / 2) = 11;
  }
  const GrayImage half = HalveImage(image);
  ASSERT_EQ(half.width(), 5);
  ASSERT_EQ(half.height(), 1);
  for (int sum = 0; sum < 5; ++sum) EXPECT_EQ(half(sum, 0), sum < 2 ? 10 : 11) << sum;
}

// The last column and row of an odd size stand for the missing ones.
TEST(HalveImage, RepeatsTheBorderOfOddSizes) {
  GrayImage image(3, 3, 0);
  image(2, 0) = image(2, 1) = 100;
  image(2, 2) = 60;
  const GrayImage half = HalveImage(image);
  ASSERT_EQ(half.width(), 2);
  ASSERT_EQ(half.height(), 2);
  EXPECT_EQ(half(0, 0), 0);
  EXPECT_EQ(half(1, 0), 100);
  EXPECT_EQ(half(1, 1), 60);
}

// Windows lie around the middles of pixels: a mirrored image has mirrored scales. Half a pixel off, it has not.
TEST(SelectWindowScales, MirrorWithTheImage) {
  constexpr int kSide = 64;
  std::mt19937 random(3);
  GrayImage image(kSide, kSide, 128), mirrored(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      if ((x / 9 + y / 11) % 3 == 0) image(x, y) = static_cast<std::uint8_t>(120 + random() % 17);
    }
  }
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) mirrored(kSide - 1 - x, kSide - 1 - y) = image(x, y);
  }
  const auto scales = SelectWindowScales(image, BuildPyramid(image, 3), MatchingWindow{});
  const auto of_mirrored = SelectWindowScales(mirrored, BuildPyramid(mirrored, 3), MatchingWindow{});
  int num_different = 0, num_levels[3] = {};
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const WindowScale other = of_mirrored(kSide - 1 - x, kSide - 1 - y);
      num_different += scales(x, y).level != other.level || scales(x, y).is_narrow != other.is_narrow;
      ++num_levels[scales(x, y).level];
    }
  }
  EXPECT_EQ(num_different, 0);
  EXPECT_GT(num_levels[0], 100);
  EXPECT_GT(num_levels[1] + num_levels[2], 100);
}

}  // namespace
}  // namespace phi
