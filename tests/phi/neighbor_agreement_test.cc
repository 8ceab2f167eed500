#include "phi/filtering/neighbor_agreement.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "phi/geometry/camera.h"

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
  JudgeByNeighbors(precision, &map);
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

// Twelve neighbours contradict; eleven are too few for that, and leave a doubt.
TEST(NeighborAgreement, FewNeighboursDoNotContradict) {
  for (const int num_neighbors : {11, 12}) {
    PlaneMap map(kSide, kSide);
    map(10, 10) = {{0, 0, -1}, 2.7f};
    for (int i = 0; i < num_neighbors; ++i) map(8 + i % 5, i < 10 ? 8 + i / 5 : 12) = {{0, 0, -1}, 3};
    const MeasurementMap judged = Judged(map);
    EXPECT_EQ(judged.states(10, 10), num_neighbors < 12 ? PixelState::kDoubtful : PixelState::kNone)
        << num_neighbors;
    EXPECT_EQ(judged.planes(10, 10).depth, num_neighbors < 12 ? 2.7f : 0) << num_neighbors;
    EXPECT_EQ(judged.planes(10, 10).normal.z, num_neighbors < 12 ? -1 : 0) << num_neighbors;
  }
}

// Two reasons to doubt a pixel are too many, one is not.
TEST(NeighborAgreement, ADoubtfulPixelWithFewWitnessesGoes) {
  MeasurementMap map = AllMeasured(PlaneMap(kSide, kSide));
  const auto put = [&](int x, int y, PixelState state) {
    map.planes(x, y) = {{0, 0, -1}, 3};
    map.states(x, y) = state;
  };
  put(3, 3, PixelState::kFewWitnesses);
  put(3, 15, PixelState::kMeasured);
  for (int y = 12; y < 17; ++y) {
    for (int x = 12; x < 17; ++x) put(x, y, PixelState::kFewWitnesses);
  }
  JudgeByNeighbors(kPrecision, &map);
  EXPECT_EQ(map.states(3, 3), PixelState::kNone);
  EXPECT_EQ(map.planes(3, 3).depth, 0);
  EXPECT_EQ(map.states(3, 15), PixelState::kDoubtful);
  EXPECT_EQ(map.planes(3, 15).depth, 3);
  EXPECT_EQ(map.states(14, 14), PixelState::kFewWitnesses);
}

// A patch of a wall: the corner pixel of three by three has its eight neighbours and stays, of two by four all are doubtful.
TEST(NeighborAgreement, WhatStandsAloneIsDoubtful) {
  for (const int width : {3, 2}) {
    PlaneMap map(kSide, kSide);
    for (int y = 8; y < (width == 3 ? 11 : 12); ++y) {
      for (int x = 8; x < 8 + width; ++x) map(x, y) = {{0, 0, -1}, 3};
    }
    const MeasurementMap judged = Judged(map);
    EXPECT_EQ(CountMeasured(judged), width == 3 ? 9 : 0);
    EXPECT_EQ(judged.states(8, 8), width == 3 ? PixelState::kMeasured : PixelState::kDoubtful);
    EXPECT_EQ(judged.planes(8, 8).depth, 3);
  }
}

// A checkerboard of two depths: at a pixel 12 of 24 neighbours are of its own. All are judged by the map as it was.
TEST(NeighborAgreement, JudgesTheMapAsItWas) {
  PlaneMap map = Wall(3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = (y % 2); x < kSide; x += 2) map(x, y).depth = 2.7f;
  }
  MeasurementMap judged = Judged(map);
  for (int y = 2; y < kSide - 2; ++y) {
    for (int x = 2; x < kSide - 2; ++x) EXPECT_EQ(judged.states(x, y), PixelState::kMeasured);
  }
  // Three columns of four at 3, one at 2.7: the latter has 4 of 24 on its side in 5 columns, and goes whole.
  map = Wall(3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; x += 4) map(x, y).depth = 2.7f;
  }
  judged = Judged(map);
  for (int x = 4; x < kSide - 2; ++x) EXPECT_EQ(judged.planes(x, 10).depth > 0, x % 4 != 0) << x;
}

// Depths that differ by 0.6 % from row to row. A match of 0.15 pixels tells them to 0.09 % with a baseline of 5, where they
// contradict each other, and to 0.9 % with one of 0.5, where they do not.
TEST(NeighborAgreement, ShortBaselinesTellLess) {
  for (const double baseline : {5.0, 0.5}) {
    Camera reference;
    reference.pinhole = {kSide, kSide, 100, 100, 10.5, 10.5};
    Camera source = reference;
    source.pinhole.width = 800;  // sees all
    source.pinhole.cx = 400;
    source.pose.translation = {-baseline, 0, 0};
    const DepthPrecision precision(kRays, {MakeRelativeView(reference, source)});
    PlaneMap map = Wall(3);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) map(x, y).depth *= y % 3 == 0 ? 1.012f : y % 3 == 1 ? 1.006f : 1;
    }
    const int num_measured = CountMeasured(Judged(map, precision));
    EXPECT_EQ(num_measured == kSide * kSide, baseline == 0.5) << num_measured;
  }
}

}  // namespace
}  // namespace phi
