#include "phi/filtering/own_texture.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

constexpr int kSide = 20;

// Columns of 127 and `bright` in turn: over 5 columns, 3 of one and 2 of the other, variance 0.24 * (bright - 127)^2.
GrayImage Stripes(std::uint8_t bright) {
  GrayImage image(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) image(x, y) = x % 2 == 0 ? 127 : bright;
  }
  return image;
}

TEST(OwnTexture, NeedsVarianceOne) {
  EXPECT_FALSE(HasOwnTexture(Stripes(127).view(), 10, 10));
  EXPECT_FALSE(HasOwnTexture(Stripes(129).view(), 10, 10));  // 0.96
  EXPECT_TRUE(HasOwnTexture(Stripes(130).view(), 10, 10));   // 2.16
}

// An edge counts for the pixels within 2 of it and no farther, however strong it is.
TEST(OwnTexture, AnEdgeBelongsToThePixelsBesideIt) {
  GrayImage image(kSide, kSide, 0);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 10; x < kSide; ++x) image(x, y) = 255;
  }
  for (int x = 0; x < kSide; ++x) {
    EXPECT_EQ(HasOwnTexture(image.view(), x, 7), x >= 8 && x <= 11) << x;
  }
}

TEST(OwnTexture, DropsDepthAndNormalOfPlainPixelsOnly) {
  GrayImage image = Stripes(200);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < 10; ++x) image(x, y) = 90;
  }
  PlaneMap map(kSide, kSide, {{0, 0, -1}, 3});
  map(15, 15).depth = 0;
  DropPlainPixels(image, &map);
  EXPECT_EQ(map(2, 5).depth, 0);
  EXPECT_EQ(map(2, 5).normal.z, 0);
  EXPECT_EQ(map(15, 5).depth, 3);
  EXPECT_EQ(map(15, 5).normal.z, -1);
  EXPECT_EQ(map(15, 15).depth, 0);
}

}  // namespace
}  // namespace phi
