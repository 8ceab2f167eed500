#include "phi/inference/anchor_cells.h"

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace phi {
namespace {

const AnchorTolerance kTolerance{0.01f, 3, {}};

TEST(AnchorCells, AreTheMeansOfTheirPoints) {
  // Cells of 10 pixels: three points in the column 2 and row -1, one beside it in the next column.
  const std::vector<AnchorPoint> points = {{21, -4, 0.503f}, {30, -4, 0.503f}, {24, -2, 0.504f}, {27, -9, 0.5035f}};
  const auto cells = MakeAnchorCells(points, 10, 1, kTolerance);
  ASSERT_EQ(cells.size(), 2u);
  EXPECT_FLOAT_EQ(cells[0].x, 24);
  EXPECT_FLOAT_EQ(cells[0].y, -5);
  EXPECT_NEAR(cells[0].w, 0.5035, 1e-7);
  EXPECT_NEAR(cells[0].tolerance, 0.005035, 1e-7);
  EXPECT_EQ(cells[0].column, 2);
  EXPECT_EQ(cells[0].row, -1);
  EXPECT_EQ(cells[1].column, 3);
}

TEST(AnchorCells, AreMeasuredWhereOneOfTheirPointsIs) {
  const std::vector<AnchorPoint> points = {{1, 1, 0.5f, false}, {2, 2, 0.5f, true}, {11, 1, 0.5f, false}, {12, 2, 0.5f, false}};
  const auto cells = MakeAnchorCells(points, 10, 1, kTolerance);
  ASSERT_EQ(cells.size(), 2u);
  EXPECT_TRUE(cells[0].is_measured);
  EXPECT_FALSE(cells[1].is_measured);
}

TEST(AnchorCells, APointAloneIsNone) {
  const std::vector<AnchorPoint> points = {{1, 1, 0.5f}, {2, 2, 0.5f}, {15, 5, 0.5f}};
  EXPECT_EQ(MakeAnchorCells(points, 10, 2, kTolerance).size(), 1u);
  EXPECT_EQ(MakeAnchorCells(points, 10, 3, kTolerance).size(), 0u);
}

TEST(AnchorCells, InverseDepthsBeyondNumbersAreNone) {
  const float inf = std::numeric_limits<float>::infinity();
  EXPECT_EQ(MakeAnchorCells({{1, 1, inf}, {1, 1, 0}, {1, 1, 1e-42f}, {1, 1, NAN}, {1, 1, 0.5f}}, 10, 1, kTolerance).size(), 1u);
}

TEST(AnchorCells, OneAboveTheOtherInDepthAreTwo) {
  const std::vector<AnchorPoint> points = {{1, 1, 0.5f}, {2, 2, 0.6f}};
  EXPECT_EQ(MakeAnchorCells(points, 10, 1, kTolerance).size(), 2u);
}

// A cell holds the depths of a seventieth of an octave; limits between cells are found from the float's bits.
TEST(AnchorCells, AreASeventiethOfAnOctaveDeep) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> octave(-6, 3);
  std::map<int, int> expected;  // points by cell
  std::vector<AnchorPoint> points;
  for (int i = 0; i < 20000; ++i) {
    points.push_back({1, 1, std::exp2(octave(random))});
    int exponent;
    const float mantissa = std::frexp(points.back().w, &exponent);
    ++expected[70 * exponent + static_cast<int>(std::floor(70 * std::log2(mantissa)))];
  }
  const auto cells = MakeAnchorCells(points, 10, 1, kTolerance);
  ASSERT_EQ(cells.size(), expected.size());
  auto cell = cells.begin();
  for (const auto& [index, count] : expected) {
    // A limit of rounded logarithms may lie a float beside the true one.
    EXPECT_GT(cell->w, std::exp2((index - 1e-4) / 70)) << index;
    EXPECT_LT(cell->w, std::exp2((index + 1 + 1e-4) / 70)) << index;
    ++cell;
  }
}

TEST(AnchorCells, AreTheSameInUnitsOfAPowerOfTwo) {
  std::vector<AnchorPoint> points, scaled;
  for (int i = 0; i < 2000; ++i) {
    points.push_back({static_cast<float>(i % 40), static_cast<float>(i / 40), 0.2f + 0.0007f * i});
    scaled.push_back({points.back().x, points.back().y, points.back().w / 1024});
  }
  const auto cells = MakeAnchorCells(points, 10, 1, kTolerance), others = MakeAnchorCells(scaled, 10, 1, kTolerance);
  ASSERT_EQ(cells.size(), others.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    ASSERT_EQ(cells[i].x, others[i].x);
    ASSERT_EQ(cells[i].w, 1024 * others[i].w);
  }
}

TEST(AnchorCells, LieOnAPlaneWithinTheirTolerance) {
  const AnchorCell cell{10, 20, 0.4, 0.002, 0, 0};
  EXPECT_NEAR(cell.Off({0.39, 0.001, 0}), 0, 1e-9);
  EXPECT_TRUE(IsOn({0.3919, 0.001, 0}, cell));
  EXPECT_FALSE(IsOn({0.3921, 0.001, 0}, cell));
  EXPECT_NEAR(cell.Off({0.36, 0.001, 0.0015}), 0, 1e-9);
  EXPECT_LT(cell.Off({0.393, 0.001, 0}), -1) << "behind the plane";
}

// f = 500 pixels, baseline 1/50 of the depth of 2: a step of a pixel is 2 / (500 * 0.04) = 10 % of the depth.
TEST(AnchorCells, MayErrByWhatMatchingCanTell) {
  Camera reference;
  reference.pinhole = {160, 120, 500, 500, 80, 60};
  Camera source = reference;
  source.pose.translation = {-0.04, 0, 0};
  const AnchorTolerance tolerance{0.003f, 3, DepthPrecision(reference, {&source})};
  EXPECT_NEAR(tolerance.At(79.5f, 59.5f, 0.5f) / 0.5, 3 * kMatchDeviation * 0.1, 0.001);
}

TEST(AnchorCells, AreAHundredAndTwentyEighthOfTheImageWide) {
  EXPECT_FLOAT_EQ(CellSide(3072), 24);
  EXPECT_FLOAT_EQ(CellSide(320), 6);
}

}  // namespace
}  // namespace phi
