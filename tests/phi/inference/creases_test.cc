#include "phi/inference/creases.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

// Left of column 500 region 0, right of it region 1; below row 60 they are parted by a thing of five columns.
Array2D<std::int32_t> TwoWalls() {
  Array2D<std::int32_t> region(1000, 100, 0);
  for (int y = 0; y < 100; ++y) {
    for (int x = 500; x < 1000; ++x) region(x, y) = 1;
    for (int x = 498; y >= 60 && x < 503; ++x) region(x, y) = -1;
  }
  return region;
}

// A 250th of 1000 pixels is four.
TEST(Creases, AreWithinAFewPixelsOfAnotherRegion) {
  const Mask creases = FindCreases(TwoWalls());
  for (const int x : {496, 499, 500, 503}) EXPECT_EQ(creases(x, 20), 255) << x;
  for (const int x : {0, 495, 504, 999}) EXPECT_EQ(creases(x, 20), 0) << x;
  EXPECT_EQ(creases(0, 0), 0);
  EXPECT_EQ(creases(999, 99), 0);
}

// Two places a direction are looked at, four and two pixels away.
TEST(Creases, ANarrowRegionIsMetAtTheReachOrHalfOfIt) {
  Array2D<std::int32_t> region(1000, 100, 0);
  for (int y = 0; y < 100; ++y) region(500, y) = 1;
  const Mask creases = FindCreases(region);
  for (const int distance : {-4, -2, 2, 4}) EXPECT_EQ(creases(500 + distance, 50), 255) << distance;
  for (const int distance : {-5, -3, -1, 1, 3, 5}) EXPECT_EQ(creases(500 + distance, 50), 0) << distance;
}

TEST(Creases, AThingsRimIsNone) {
  const Mask creases = FindCreases(TwoWalls());
  EXPECT_EQ(creases(497, 80), 0);
  EXPECT_EQ(creases(503, 80), 0);
}

// Diagonally, too: the corner of region 1 is at (30, 20).
TEST(Creases, ReachThreePixelsInSmallImages) {
  Array2D<std::int32_t> region(60, 40, 0);
  for (int y = 20; y < 40; ++y) {
    for (int x = 30; x < 60; ++x) region(x, y) = 1;
  }
  const Mask creases = FindCreases(region);
  EXPECT_EQ(creases(45, 17), 255);
  EXPECT_EQ(creases(45, 16), 0);
  EXPECT_EQ(creases(45, 22), 255);
  EXPECT_EQ(creases(45, 23), 0);
  EXPECT_EQ(creases(27, 30), 255);
  EXPECT_EQ(creases(26, 30), 0);
  EXPECT_EQ(creases(27, 17), 255) << "by the corner alone";
  EXPECT_EQ(creases(27, 16), 0);
}

}  // namespace
}  // namespace phi
