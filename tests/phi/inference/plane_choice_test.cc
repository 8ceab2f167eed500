#include "phi/inference/plane_choice.h"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "phi/inference/region_planes.h"

namespace phi {
namespace {

using Planes = std::array<RegionPlane, kPlanesPerRegion>;

constexpr PlaneChoiceLimits kLimits{3, 0.05, 0.02, 5, 8};
const ImagePlane kWall{0.3, 0.001, 0}, kShelf{0.4, 0, 0.001};

// One every 10 pixels in a rectangle, on the plane times `factor`.
std::vector<AnchorCell> CellsOn(const ImagePlane& plane, int x0, int x1, int y0, int y1, double factor = 1) {
  std::vector<AnchorCell> cells;
  for (int y = y0; y < y1; y += 10) {
    for (int x = x0; x < x1; x += 10) {
      const double w = factor * plane.InverseDepth(x, y);
      cells.push_back({static_cast<float>(x), static_cast<float>(y), w, 0.003 * w, x / 10, y / 10});
    }
  }
  return cells;
}

std::vector<AnchorCell> Both(std::vector<AnchorCell> a, const std::vector<AnchorCell>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// That reaches everywhere.
RegionPlane Own(const ImagePlane& plane) { return {plane, 0, 0, 1e-9, 0, 1e-9}; }

void ExpectIs(const RegionPlane& chosen, const ImagePlane& plane) {
  EXPECT_EQ(std::tuple(chosen.a, chosen.b, chosen.c), std::tuple(plane.a, plane.b, plane.c));
}

TEST(PlaneChoice, TheScenesIsTakenWhereMoreCellsLieOnIt) {
  const auto cells = Both(CellsOn(kWall, 0, 100, 0, 40), CellsOn(kShelf, 0, 100, 100, 120));
  ExpectIs(ChoosePlanes(cells, Planes{Own(kShelf)}, std::array{kWall}, kLimits)[0], kWall);
}

TEST(PlaneChoice, TheOwnIsKeptWhereMoreCellsLieOnIt) {
  const auto cells = Both(CellsOn(kShelf, 0, 100, 0, 40), CellsOn(kWall, 0, 100, 100, 120));
  const RegionPlane chosen = ChoosePlanes(cells, Planes{Own(kShelf)}, std::array{kWall}, kLimits)[0];
  ExpectIs(chosen, kShelf);
  EXPECT_EQ(chosen.xx, 1e-9) << "with its own reach";
}

TEST(PlaneChoice, OfTwoThatAllCellsLieOnTheNearerIsTaken) {
  const auto cells = CellsOn(kWall, 0, 100, 0, 100, 1.0005);
  const ImagePlane off{0.3006, 0.001, 0};
  ExpectIs(ChoosePlanes(cells, Planes{}, std::array{off, kWall}, kLimits)[0], kWall);
  ExpectIs(ChoosePlanes(cells, Planes{}, std::array{kWall, off}, kLimits)[0], kWall);
}

// Eight cells of a shelf hide nothing of the wall that six show behind it: the shelf is not the region's surface.
TEST(PlaneChoice, WhatLiesBehindAPlaneCountsAgainstItWhatLiesBeforeDoesNot) {
  const auto cells = Both(CellsOn(kShelf, 0, 80, 50, 60), CellsOn(kWall, 0, 60, 0, 10));
  ASSERT_EQ(cells.size(), 14u);
  ExpectIs(ChoosePlanes(cells, Planes{Own(kShelf)}, std::array{kWall}, kLimits)[0], kWall);
  const auto more = Both(CellsOn(kShelf, 0, 130, 50, 60), CellsOn(kWall, 0, 60, 0, 10));
  ExpectIs(ChoosePlanes(more, Planes{Own(kShelf)}, std::array{kWall}, kLimits)[0], kShelf);
}

TEST(PlaneChoice, FewCellsAreNotEnough) {
  EXPECT_FALSE(ChoosePlanes(CellsOn(kWall, 0, 20, 0, 10), Planes{}, std::array{kWall}, kLimits)[0].IsThere());
  EXPECT_TRUE(ChoosePlanes(CellsOn(kWall, 0, 30, 0, 10), Planes{}, std::array{kWall}, kLimits)[0].IsThere());
  const ImagePlane lamp{1, 0, 0};
  const auto three_of_103 = Both(CellsOn(kWall, 0, 30, 0, 10), CellsOn(lamp, 0, 100, 100, 200));
  EXPECT_FALSE(ChoosePlanes(three_of_103, Planes{}, std::array{kWall}, kLimits)[0].IsThere());
}

TEST(PlaneChoice, APlaneOfTheSceneReachesFiveDeviationsFromItsCells) {
  const RegionPlane chosen = ChoosePlanes(CellsOn(kWall, 0, 110, 0, 110), Planes{}, std::array{kWall}, kLimits)[0];
  // Places 0 to 100 in steps of 10: mean 50, variance 1000, and 64 for a cell's own size: 5 * sqrt(1064) = 163.1.
  EXPECT_GT(chosen.At(50 + 163, 50), 0);
  EXPECT_EQ(chosen.At(50 + 164, 50), 0);
  EXPECT_FLOAT_EQ(chosen.At(60, 70), static_cast<float>(kWall.InverseDepth(60, 70)));
}

TEST(PlaneChoice, TwoWallsThatMeetAreBothTaken) {
  // They meet at x = 100.
  const ImagePlane left{0.3, 0.001, 0}, right{0.5, -0.001, 0};
  const auto cells = Both(CellsOn(left, 0, 100, 0, 50), CellsOn(right, 110, 180, 0, 50));
  const Planes chosen = ChoosePlanes(cells, Planes{}, std::array{right, left}, kLimits);
  ExpectIs(chosen[0], left);
  ExpectIs(chosen[1], right);
}

// A plain image whose only anchors are 50 pixels in a corner: too few for a plane of their own.
TEST(RegionPlanes, ARegionWithFewAnchorsTakesTheScenesPlane) {
  Array2D<float> anchors(160, 120);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 10; ++x) anchors(3 * x, 2 * y) = static_cast<float>(kWall.InverseDepth(3 * x, 2 * y));
  }
  const auto planes = [&](std::vector<ImagePlane> scene) {
    return RegionPlanes(GrayImage(160, 120, 120), std::as_const(anchors).view(), 3, {.pooled = {}, .scene = std::move(scene), .precision = {}});
  };
  EXPECT_FALSE(planes({}).At(20, 20)[0].IsThere());
  EXPECT_TRUE(planes({kShelf, kWall}).At(20, 20)[0].IsThere());
  ExpectIs(planes({kShelf, kWall}).At(20, 20)[0], kWall);
}

}  // namespace
}  // namespace phi
