#include "phi/nearest_point_ranges.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace phi {
namespace {

TEST(NearestPointDepthRanges, OnePointPerQuadrant) {
  // The cell with columns and rows 48 to 51 has its centre at (50, 50); the radius is 10 pixels.
  const std::vector<SparseObservation> points = {{45, 45, 1}, {47, 47, 2}, {55, 45, 3},
                                                 {55, 55, 9}, {44, 44, 7}, {50, 61, 100}};
  const DepthRangeMap map = NearestPointDepthRanges(points, 100, 80);
  EXPECT_EQ(map.width(), 25);
  EXPECT_EQ(map.height(), 20);
  // (45, 45) and (44, 44) lie behind (47, 47) in one quadrant; (50, 61) is 11 pixels away.
  EXPECT_EQ(map(12, 12).min, 2);
  EXPECT_EQ(map(12, 12).max, 9);
  EXPECT_EQ(map(0, 0).max, 0);
}

TEST(NearestPointDepthRanges, FewerThanTwoQuadrantsAreUnknown) {
  const DepthRangeMap map = NearestPointDepthRanges({{45, 45, 1}, {47, 47, 2}}, 100, 80);
  EXPECT_EQ(map(12, 12).min, 0);
  EXPECT_EQ(map(12, 12).max, 0);
}

TEST(NearestPointDepthRanges, AgreesWithExhaustiveSearchInAnyOrder) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> u(-3, 313), v(-3, 243), depth(1, 9);
  std::vector<SparseObservation> points;
  for (int k = 0; k < 600; ++k) points.push_back({u(random), v(random), depth(random)});
  const DepthRangeMap map = NearestPointDepthRanges(points, 310, 240);
  std::shuffle(points.begin(), points.end(), random);
  const DepthRangeMap shuffled = NearestPointDepthRanges(points, 310, 240);
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      float nearest[4] = {31 * 31, 31 * 31, 31 * 31, 31 * 31}, depths[4] = {0, 0, 0, 0};
      for (const SparseObservation& p : points) {
        const float du = p.u - (4 * x + 2), dv = p.v - (4 * y + 2);
        const int q = (du >= 0 ? 1 : 0) + (dv >= 0 ? 2 : 0);
        if (du * du + dv * dv < nearest[q]) {
          nearest[q] = du * du + dv * dv;
          depths[q] = p.depth;
        }
      }
      float lo = 100, hi = 0;
      int count = 0;
      for (const float d : depths) {
        if (d == 0) continue;
        ++count;
        lo = std::min(lo, d);
        hi = std::max(hi, d);
      }
      ASSERT_EQ(map(x, y).min, count < 2 ? 0 : lo) << x << " " << y;
      ASSERT_EQ(map(x, y).max, count < 2 ? 0 : hi) << x << " " << y;
      ASSERT_EQ(map(x, y).max, shuffled(x, y).max);
    }
  }
}

}  // namespace
}  // namespace phi
