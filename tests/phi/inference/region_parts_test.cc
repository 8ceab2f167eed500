#include "phi/inference/region_parts.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "phi/inference/connected_runs.h"

namespace phi {
namespace {

void Fill(int left, int top, int width, int height, Mask* mask) {
  for (int y = top; y < top + height; ++y) {
    for (int x = left; x < left + width; ++x) (*mask)(x, y) = 255;
  }
}

// Two squares of 20 pixels, 10 apart, and a way of five rows between them. The cores are what lies three pixels inside.
struct TwoSquares {
  Mask inside{60, 30, 0}, wide{60, 30, 0};

  TwoSquares() {
    Fill(5, 5, 20, 20, &inside);
    Fill(35, 5, 20, 20, &inside);
    Fill(25, 12, 10, 5, &inside);
    Fill(8, 8, 14, 14, &wide);
    Fill(38, 8, 14, 14, &wide);
  }
};

TEST(ConnectedRuns, AreNumberedByTheirFirstPixels) {
  Mask mask(8, 4, 0);
  Fill(5, 0, 2, 4, &mask);
  Fill(0, 1, 3, 1, &mask);
  Fill(3, 2, 1, 2, &mask);  // touches the former at a corner only
  const ConnectedRuns found = FindConnectedRuns(mask);
  EXPECT_EQ(found.sizes, (std::vector<std::int64_t>{8, 3, 2}));
  const Array2D<std::int32_t> labels = LabelImage(found, 8, 4);
  EXPECT_EQ(labels(5, 0), 0);
  EXPECT_EQ(labels(6, 3), 0);
  EXPECT_EQ(labels(2, 1), 1);
  EXPECT_EQ(labels(3, 3), 2);
  EXPECT_EQ(labels(4, 0), -1);
}

// A row's last pixel and the next row's first are neighbours in memory alone.
TEST(ConnectedRuns, EndAtTheBorder) {
  Mask mask(5, 3, 0);
  Fill(3, 0, 2, 1, &mask);
  Fill(0, 1, 2, 1, &mask);
  Fill(4, 1, 1, 2, &mask);
  const ConnectedRuns found = FindConnectedRuns(mask);
  EXPECT_EQ(found.sizes, (std::vector<std::int64_t>{4, 2}));
  EXPECT_EQ(FindConnectedRuns(Mask(5, 3, 0)).runs.size(), 0u);
  EXPECT_EQ(FindConnectedRuns(Mask(5, 3, 255)).sizes, std::vector<std::int64_t>{15});
}

TEST(RegionParts, EachPixelGoesToTheNearerCore) {
  const TwoSquares squares;
  ASSERT_EQ(FindConnectedRuns(squares.inside).sizes.size(), 1u);
  const ImageRegions parts = PartAtNecks(squares.inside, squares.wide, 14 * 14);
  ASSERT_EQ(parts.num_regions, 2);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 60; ++x) {
      // The cores end at 21 and begin at 38: as far from both is 29.5.
      const std::int32_t expected = squares.inside(x, y) == 0 ? -1 : x < 29.5 ? 0 : 1;
      ASSERT_EQ(parts.region(x, y), expected) << x << ", " << y;
    }
  }
}

TEST(RegionParts, ACoreThatIsTooSmallIsNone) {
  const TwoSquares squares;
  const ImageRegions one = PartAtNecks(squares.inside, squares.wide, 14 * 14 + 1);
  EXPECT_EQ(one.num_regions, 1);
  EXPECT_EQ(one.region(10, 10), one.region(50, 10));
}

TEST(RegionParts, WhatHasNoTwoCoresStaysWhole) {
  Mask inside(60, 30, 0), wide(60, 30, 0);
  Fill(5, 5, 20, 20, &inside);
  Fill(8, 8, 14, 14, &wide);
  Fill(25, 12, 30, 3, &inside);  // a long thin piece, as wide as no core
  Fill(5, 27, 50, 2, &inside);   // and one on its own
  const ImageRegions parts = PartAtNecks(inside, wide, 10);
  ASSERT_EQ(parts.num_regions, 2);
  EXPECT_EQ(parts.region(54, 13), parts.region(10, 10));
  EXPECT_NE(parts.region(54, 28), parts.region(10, 10));
}

// An area to the left, whose first pixel is below, and a whole one between the parts.
TEST(RegionParts, AreNumberedByTheirFirstPixels) {
  TwoSquares squares;
  Fill(0, 10, 3, 3, &squares.inside);
  Fill(28, 0, 3, 3, &squares.inside);
  const ImageRegions parts = PartAtNecks(squares.inside, squares.wide, 100);
  ASSERT_EQ(parts.num_regions, 4);
  EXPECT_EQ(parts.region(29, 1), 0);
  EXPECT_EQ(parts.region(5, 5), 1);
  EXPECT_EQ(parts.region(54, 5), 2);
  EXPECT_EQ(parts.region(1, 11), 3);
}

// The way round is longer than the way across, which is not inside.
TEST(RegionParts, TheWayLeadsThroughTheArea) {
  Mask inside(50, 40, 0), wide(50, 40, 0);
  Fill(0, 0, 20, 15, &inside);
  Fill(30, 0, 20, 15, &inside);
  Fill(0, 15, 5, 20, &inside);
  Fill(5, 30, 40, 5, &inside);
  Fill(45, 15, 5, 20, &inside);
  Fill(20, 16, 25, 5, &inside);  // hangs from the right one's way down
  Fill(3, 3, 14, 9, &wide);
  Fill(33, 3, 14, 9, &wide);
  const ImageRegions parts = PartAtNecks(inside, wide, 100);
  ASSERT_EQ(parts.num_regions, 2);
  EXPECT_EQ(parts.region(20, 18), parts.region(40, 5)) << "nearer to the left one only as the crow flies";
}

}  // namespace
}  // namespace phi
