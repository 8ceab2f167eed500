#include "phi/inference/creases.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

// Left of column 500 region 0, right of it region 1; below row 60 they are parted by a thing of five columns.
ImageRegions TwoWalls() {
  ImageRegions regions{Array2D<std::int32_t>(1000, 100, 0), 2};
  for (int y = 0; y < 100; ++y) {
    for (int x = 500; x < 1000; ++x) regions.region(x, y) = 1;
    for (int x = 498; y >= 60 && x < 503; ++x) regions.region(x, y) = -1;
  }
  return regions;
}

// A 250th of 1000 pixels is four.
TEST(Creases, AreWithinAFewPixelsOfAnotherRegion) {
  const ImageRegions walls = TwoWalls();
  EXPECT_TRUE(IsAtCrease(walls, 0, 499, 20));
  EXPECT_TRUE(IsAtCrease(walls, 0, 496, 20));
  EXPECT_FALSE(IsAtCrease(walls, 0, 495, 20));
  EXPECT_TRUE(IsAtCrease(walls, 1, 503, 20));
  EXPECT_FALSE(IsAtCrease(walls, 1, 504, 20));
  EXPECT_FALSE(IsAtCrease(walls, 0, 0, 0));
  EXPECT_FALSE(IsAtCrease(walls, 1, 999, 99));
}

// Two places a direction are looked at, four and two pixels away.
TEST(Creases, ANarrowRegionIsMetAtTheReachOrHalfOfIt) {
  ImageRegions regions{Array2D<std::int32_t>(1000, 100, 0), 2};
  for (int y = 0; y < 100; ++y) regions.region(500, y) = 1;
  for (const int distance : {-4, -2, 2, 4}) EXPECT_TRUE(IsAtCrease(regions, 0, 500 + distance, 50)) << distance;
  for (const int distance : {-5, -3, -1, 1, 3, 5}) EXPECT_FALSE(IsAtCrease(regions, 0, 500 + distance, 50)) << distance;
}

TEST(Creases, AThingsRimIsNone) {
  const ImageRegions walls = TwoWalls();
  EXPECT_FALSE(IsAtCrease(walls, 0, 497, 80));
  EXPECT_FALSE(IsAtCrease(walls, 1, 503, 80));
  EXPECT_TRUE(IsAtCrease(walls, 0, 500, 80)) << "on the thing, beside the other wall";
}

TEST(Creases, ReachThreePixelsInSmallImages) {
  ImageRegions regions{Array2D<std::int32_t>(60, 40, 0), 2};
  for (int y = 20; y < 40; ++y) {
    for (int x = 0; x < 60; ++x) regions.region(x, y) = 1;
  }
  EXPECT_TRUE(IsAtCrease(regions, 0, 30, 17));
  EXPECT_FALSE(IsAtCrease(regions, 0, 30, 16));
  EXPECT_TRUE(IsAtCrease(regions, 1, 30, 22));
  EXPECT_FALSE(IsAtCrease(regions, 1, 30, 23));
}

}  // namespace
}  // namespace phi
