// Neighbours' planes carried on to a pixel, also on planes so slanted that half a pixel decides: in a camera of short focal length the
// plane's depth changes by up to a fifth from pixel to pixel. Expected values come from the plane's equation.
#include "phi/filtering/neighbor_planes.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace phi {
namespace {

constexpr int kSide = 21;
constexpr RayModel kRays{.fx = 20, .fy = 20, .cx = 10.5f, .cy = 10.5f, .width = kSide, .height = kSide};

// The plane n . X = offset, seen at pixel centres (x + 1/2, y + 1/2).
PlaneMap Plane(const Vec3f& n, double offset) {
  PlaneMap map(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double ray_x = (x + 0.5 - 10.5) / 20, ray_y = (y + 0.5 - 10.5) / 20;
      map(x, y) = {n, static_cast<float>(offset / (n.x * ray_x + n.y * ray_y + n.z))};
    }
  }
  return map;
}

// How many neighbours of each pixel agree. `deviation`: what matching can tell of every depth, relative.
Array2D<int> Count(const PlaneMap& map, int spacing = 1, float deviation = 0) {
  Array2D<int> result(kSide, kSide);
  ForNeighborCounts(kRays, map, Mask(kSide, kSide, 255), Array2D<float>(kSide, kSide, deviation), spacing,
                    [&](int y, const std::vector<std::int32_t>& counts) {
                      for (int x = 0; x < kSide; ++x) result(x, y) = counts[x];
                    });
  return result;
}

// Pixels on one axis up to two away that lie in the map, the pixel among them.
int NumBeside(int x) { return std::min(x + 2, kSide - 1) - std::max(x - 2, 0) + 1; }

// The steepest pixels see their plane at 82 degrees from its normal.
TEST(NeighborPlanes, AllAgreeOnASlantedPlane) {
  for (const Vec3f n : {Vec3f{0.83f, 0, -0.5577634f}, Vec3f{0, 0.83f, -0.5577634f}, Vec3f{-0.83f, 0, -0.5577634f},
                        Vec3f{0, -0.83f, -0.5577634f}}) {
    const Array2D<int> counts = Count(Plane(n, -2));
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) ASSERT_EQ(counts(x, y), NumBeside(x) * NumBeside(y) - 1) << x << ", " << y;
    }
    EXPECT_EQ(counts(10, 10), kNumNeighbors);
    EXPECT_EQ(counts(0, 0), 8);
    EXPECT_EQ(counts(20, 10), 14);
  }
}

// The limit is 0.3 % of the depth, wherever on the slant, or 1.5 deviations.
TEST(NeighborPlanes, TheLimitIsAShareOfTheDepthOrWhatMatchingCanTell) {
  const Vec3f n{0.83f, 0, -0.5577634f};
  for (const float deviation : {0.0f, 0.004f}) {
    const float limit = deviation > 0 ? 0.006f : 0.003f;
    for (const int x : {2, 10, 17}) {
      for (const float error : {-0.93f * limit, 0.93f * limit, -1.07f * limit, 1.07f * limit}) {
        PlaneMap map = Plane(n, -2);
        map(x, 9).depth *= 1 + error;
        EXPECT_EQ(Count(map, 1, deviation)(x, 9), std::abs(error) < limit ? kNumNeighbors : 0) << x << ", " << error;
      }
    }
  }
}

// A wall's pixel with the wall's depth and another normal: it agrees with its neighbours, its own plane misses theirs.
TEST(NeighborPlanes, APlaneCountsAndNotItsDepthAlone) {
  PlaneMap map = Plane({0, 0, -1}, -3);
  map(10, 10).normal = {0.6f, 0, -0.8f};
  const Array2D<int> counts = Count(map);
  EXPECT_EQ(counts(10, 10), kNumNeighbors);
  EXPECT_EQ(counts(11, 10), kNumNeighbors - 1);
}

// Rows are counted by bands, which threads share: what lies in the next band is a neighbour as well.
TEST(NeighborPlanes, TheBorderOfTwoBandsIsNone) {
  constexpr int kRows = 150;
  const RayModel rays{.fx = 20, .fy = 20, .cx = 10.5f, .cy = 75, .width = kSide, .height = kRows};
  for (const int spacing : {1, 3}) {
    ForNeighborCounts(rays, PlaneMap(kSide, kRows, {{0, 0, -1}, 3}), Mask(kSide, kRows, 255), Array2D<float>(kSide, kRows, 0.0f),
                      spacing, [&](int y, const std::vector<std::int32_t>& counts) {
                        if (y >= 2 * spacing && y < kRows - 2 * spacing) { EXPECT_EQ(counts[10], kNumNeighbors) << y; }
                      });
  }
}

// Only their counts are told, whatever else lies in their pieces of rows.
TEST(NeighborPlanes, WantedPixelsAloneAreCounted) {
  constexpr int kWidth = 150;  // two pieces and a part
  const RayModel rays{.fx = 20, .fy = 20, .cx = 75, .cy = 10.5f, .width = kWidth, .height = kSide};
  const PlaneMap map(kWidth, kSide, {{0, 0, -1}, 3});
  const Array2D<float> deviations(kWidth, kSide, 0.0f);
  for (const int wanted_x : {0, 63, 64, 127, 128, 149}) {
    Mask wanted(kWidth, kSide, 0);
    wanted(wanted_x, 10) = 255;
    const int beside = std::min(wanted_x + 2, kWidth - 1) - std::max(wanted_x - 2, 0) + 1;
    ForNeighborCounts(rays, map, wanted, deviations, 1, [&](int y, const std::vector<std::int32_t>& counts) {
      if (y == 10) { EXPECT_EQ(counts[wanted_x], 5 * beside - 1) << wanted_x; }
    });
  }
}

TEST(NeighborPlanes, TheSpacingSaysWhichPixelsAreAsked) {
  PlaneMap map = Plane({0, 0, -1}, -3);
  for (const int x : {7, 4}) map(x, 10).depth = 0;
  EXPECT_EQ(Count(map, 3)(10, 10), kNumNeighbors - 2);
  EXPECT_EQ(Count(map, 1)(10, 10), kNumNeighbors);
}

}  // namespace
}  // namespace phi
