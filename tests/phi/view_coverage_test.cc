#include "phi/view_coverage.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace phi {
namespace {

// A good view of point `point`, which the reference shows at (u, v).
ViewSample Good(int view, std::uint32_t point, float u, float v) {
  ViewSample sample;
  sample.view = view;
  sample.point = point;
  sample.angle = 0.17f;  // 10 degrees
  sample.to_source = {std::sin(0.17f), 0, -std::cos(0.17f)};
  sample.u = u;
  sample.v = v;
  return sample;
}

// One point of a cell may be mismatched: it counts a quarter of the cell, two together two fifths.
TEST(ViewCoverage, ACellWithFewPointsCountsLess) {
  std::vector<ViewSample> samples = {Good(0, 0, 0.1f, 0.1f)};
  for (std::uint32_t point = 1; point <= 2; ++point) samples.push_back(Good(1, point, 0.9f, 0.9f));
  EXPECT_EQ(ViewCoverage(samples, {5, 9}).Take({0, 1}, 2), (std::vector<int>{1, 0}));
}

// Ten points in one cell count ten thirteenths of it, in two cells five eighths of each: twelve columns, eight rows.
TEST(ViewCoverage, PointsOfOneCellShareIt) {
  constexpr float kColumn = 1 / 12.0f, kRow = 1 / 8.0f;
  const auto first_of = [](float u, float v) {
    std::vector<ViewSample> samples;
    for (std::uint32_t point = 0; point < 10; ++point) samples.push_back(Good(0, point, 0.02f, 0.02f));
    for (std::uint32_t point = 10; point < 20; ++point) {
      samples.push_back(point % 2 == 0 ? Good(1, point, 0.5f + kColumn / 2, 0.5f + kRow / 2) : Good(1, point, u, v));
    }
    return ViewCoverage(samples, {5, 9}).Take({0, 1}, 1);
  };
  EXPECT_EQ(first_of(0.5f + 0.9f * kColumn, 0.5f + 0.9f * kRow), std::vector<int>{0}) << "in one cell: equal, by the number";
  EXPECT_EQ(first_of(0.5f + 1.1f * kColumn, 0.5f + kRow / 2), std::vector<int>{1}) << "in the next column";
  EXPECT_EQ(first_of(0.5f + kColumn / 2, 0.5f + 1.1f * kRow), std::vector<int>{1}) << "in the next row";
}

}  // namespace
}  // namespace phi
