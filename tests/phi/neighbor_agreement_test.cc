#include "phi/filtering/neighbor_agreement.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "phi/geometry/camera.h"
#include "phi/geometry/depth_precision.h"

namespace phi {
namespace {

constexpr int kSide = 21;
constexpr RayModel kRays{.fx = 100, .fy = 100, .cx = 10.5f, .cy = 10.5f, .width = kSide, .height = kSide};
const DepthPrecision kPrecision(kRays, {});  // no source views: the tolerance is the share of the depth

// The plane n . X = offset.
PlaneMap Plane(Vec3f normal, float offset) {
  PlaneMap map(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      map(x, y) = {normal, offset / Dot(normal, kRays.Ray(x + 0.5f, y + 0.5f))};
    }
  }
  return map;
}

PlaneMap Wall(float depth) { return Plane({0, 0, -1}, -depth); }

MeasurementMap Judged(const PlaneMap& planes, const DepthPrecision& precision = kPrecision) {
  MeasurementMap map = AllMeasured(planes);
  DropLonelyPixels(precision.reference(), precision.RelativeDeviations(planes), &map);
  return map;
}

int CountMeasured(const MeasurementMap& map) {
  return static_cast<int>(std::count(map.states.begin(), map.states.end(), PixelState::kMeasured));
}
int CountKept(const PlaneMap& map) { return CountMeasured(Judged(map)); }

// Along x the depth changes by 7.5 % in 10 pixels: neighbours 2 pixels away differ by 1.5 %, but lie on one plane.
TEST(NeighborAgreement, ASlantedPlaneStays) {
  EXPECT_EQ(CountKept(Plane({0.6f, 0, -0.8f}, -2)), kSide * kSide);
}

TEST(NeighborAgreement, APixelOffItsSurfaceGoesAndItsNeighboursStay) {
  for (const float error : {-0.0031f, 0.0032f}) {
    PlaneMap map = Wall(3);
    map(8, 12).depth *= 1 + error;
    const MeasurementMap judged = Judged(map);
    EXPECT_EQ(judged.states(8, 12), PixelState::kNone);
    EXPECT_EQ(judged.planes(8, 12).depth, 0);
    EXPECT_EQ(judged.planes(8, 12).normal.z, 0);
    EXPECT_EQ(CountMeasured(judged), kSide * kSide - 1);
  }
  PlaneMap map = Wall(3);
  map(8, 12).depth *= 1.0025f;
  EXPECT_EQ(CountKept(map), kSide * kSide);
}

// A bar before a wall, 10 % nearer. Of 24 neighbours 4 agree with its pixels where it is one pixel wide, 9 where it is two,
// and 14 with those at its rim where it is three.
TEST(NeighborAgreement, BarsOfThreePixelsStay) {
  for (const int width : {1, 2, 3}) {
    PlaneMap map = Wall(3);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 9; x < 9 + width; ++x) map(x, y).depth = 2.7f;
    }
    EXPECT_EQ(CountKept(map), kSide * (width < 3 ? kSide - width : kSide)) << width;
  }
}

// The corner pixel of a nearer square goes, 8 of 24 agree; those beside it stay with 11, the wall's around it with 15.
TEST(NeighborAgreement, ASquareLosesItsCornerPixel) {
  PlaneMap map = Wall(3);
  for (int y = 10; y < kSide; ++y) {
    for (int x = 10; x < kSide; ++x) map(x, y).depth = 2.7f;
  }
  const MeasurementMap judged = Judged(map);
  EXPECT_EQ(judged.planes(10, 10).depth, 0);
  EXPECT_EQ(CountMeasured(judged), kSide * kSide - 1);
}

// All depths are the wall's, but planes of all others fall by 45 degrees: 1 % a pixel, so that only those in the pixel's own
// column pass through it, 4 of 24.
TEST(NeighborAgreement, APlaneCountsAndNotItsDepthAlone) {
  const float s = 0.70710678f;
  PlaneMap map(kSide, kSide, {{s, 0, -s}, 3});
  const MeasurementMap judged = Judged(map);
  for (int y = 2; y < kSide - 2; ++y) {
    for (int x = 2; x < kSide - 2; ++x) EXPECT_EQ(judged.planes(x, y).depth, 0) << x << ", " << y;
  }
}

// Eight neighbours agree. Of 20 that are eight 40 %, of 21 less.
TEST(NeighborAgreement, FourOfTenNeighboursAreEnough) {
  for (const int num_others : {12, 13}) {
    PlaneMap map(kSide, kSide);
    map(10, 10) = {{0, 0, -1}, 3};
    int placed = 0;
    for (int y = 8; y <= 12; ++y) {
      for (int x = 8; x <= 12; ++x) {
        if ((x == 10 && y == 10) || placed == 8 + num_others) continue;
        map(x, y) = {{0, 0, -1}, placed < 8 ? 3.0f : 2.7f};
        ++placed;
      }
    }
    EXPECT_EQ(Judged(map).states(10, 10), num_others == 12 ? PixelState::kMeasured : PixelState::kNone) << num_others;
  }
}

// Seven agree and nobody contradicts; eight are a third of all.
TEST(NeighborAgreement, WhatStandsAloneGoesAndOthersKeepTheirState) {
  for (const int num_neighbors : {7, 8}) {
    MeasurementMap map = AllMeasured(PlaneMap(kSide, kSide));
    const auto put = [&](int x, int y) {
      map.planes(x, y) = {{0, 0, -1}, 3};
      map.states(x, y) = PixelState::kUnsure;
    };
    put(10, 10);
    for (int i = 0; i < num_neighbors; ++i) put(8 + i % 5, 8 + i / 5);
    DropLonelyPixels(kPrecision.reference(), kPrecision.RelativeDeviations(map.planes), &map);
    EXPECT_EQ(map.states(10, 10), num_neighbors == 8 ? PixelState::kUnsure : PixelState::kNone) << num_neighbors;
    EXPECT_EQ(map.planes(10, 10).depth, num_neighbors == 8 ? 3 : 0) << num_neighbors;
  }
}

}  // namespace
}  // namespace phi
