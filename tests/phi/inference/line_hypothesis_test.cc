#include "phi/inference/line_hypothesis.h"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "phi/inference/hypotheses.h"
#include "tests/support/region_hypotheses.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 120, kHeight = 90;

// An oblique plane: 1 / z = 0.25 + 0.0015 x - 0.001 y, depths from 2.3 m to 6.3 m.
float ObliquePlane(int x, int y) { return 0.25f + 0.0015f * x - 0.001f * y; }

template <typename InverseDepth>
PlaneMap MakeMap(const InverseDepth& inverse_depth) {
  PlaneMap map(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float w = inverse_depth(x, y);
      map(x, y).normal = {0, 0, -1};
      map(x, y).depth = w > 0 ? 1 / w : 0;
    }
  }
  return map;
}

float ValueAt(const PlaneMap& map, Formulas formulas, int direction, int x, int y) {
  return Hypotheses(AllMeasured(map), formulas).state().maps.inverse_depth[direction](x, y);
}

TEST(Scanline, EveryDirectionCoversEachPixelOnce) {
  for (int direction = 0; direction < kNumDirections; ++direction) {
    for (const auto& [width, height] : {std::pair{7, 4}, std::pair{4, 7}, std::pair{1, 5}, std::pair{5, 1}}) {
      Array2D<int> visits(width, height, 0);
      for (int i = 0; i < NumScanlines(direction, width, height); ++i) {
        const Scanline line = MakeScanline(direction, i, width, height);
        EXPECT_GT(line.length, 0);
        for (int t = 0; t < line.length; ++t) {
          const int x = line.x0 + t * line.dx, y = line.y0 + t * line.dy;
          ASSERT_TRUE(visits.view().Contains(x, y));
          ++visits(x, y);
        }
      }
      for (const int v : visits) EXPECT_EQ(v, 1);
    }
  }
}

TEST(LineHypothesis, IsExactOnAnObliquePlaneInAllDirections) {
  const auto hole = [](int x, int y) { return x >= 40 && x < 48 && y >= 30 && y < 38; };
  const PlaneMap map = MakeMap([&](int x, int y) { return hole(x, y) ? 0.0f : ObliquePlane(x, y); });
  const Hypotheses hypotheses(AllMeasured(map), Formulas::kRobust);
  for (int direction = 0; direction < kNumDirections; ++direction) {
    for (int y = 30; y < 38; ++y) {
      for (int x = 40; x < 48; ++x) {
        const float w = hypotheses.state().maps.inverse_depth[direction](x, y);
        EXPECT_NEAR(w, ObliquePlane(x, y), 1e-6f) << "direction " << direction << " at " << x << ", " << y;
      }
    }
  }
}

TEST(LineHypothesis, ThePapersLinesFitDepthAndBendOnAnObliquePlane) {
  const PlaneMap map = MakeMap([&](int x, int y) { return x >= 40 && x < 80 ? 0.0f : ObliquePlane(x, y); });
  // Depths 1 / w at x = 37..39 and 80..82, least squares in depth, at x = 60, y = 45: worked out here in double.
  double st = 0, sd = 0, stt = 0, std_ = 0;
  for (const int x : {37, 38, 39, 80, 81, 82}) {
    const double d = 1 / (0.25 + 0.0015 * x - 0.001 * 45);
    st += x, sd += d, stt += double(x) * x, std_ += x * d;
  }
  const double slope = (6 * std_ - st * sd) / (6 * stt - st * st);
  const double depth = sd / 6 + slope * (60 - st / 6);
  EXPECT_NEAR(1 / ValueAt(map, Formulas::kPaper, kHorizontal, 60, 45), depth, 1e-4);
  EXPECT_GT(std::abs(depth - 1 / ObliquePlane(60, 45)), 0.03);  // 3 cm off the plane
}

TEST(LineHypothesis, DoesNotFillAcrossADepthEdge) {
  // A wall at 2 m on the left, one at 3 m on the right, nothing measured between x = 30 and x = 90.
  const PlaneMap map = MakeMap([](int x, int) { return x < 30 ? 0.5f : x >= 90 ? 1 / 3.0f : 0.0f; });
  const Hypotheses hypotheses(AllMeasured(map), Formulas::kRobust);
  const int reach = LineOptions().max_reach;
  for (int x = 30; x < 90; ++x) {
    const float w = hypotheses.state().maps.inverse_depth[kHorizontal](x, 45);
    if (x - 29 <= reach) {
      EXPECT_NEAR(w, 0.5f, 1e-6f) << x;
    } else if (90 - x <= reach) {
      EXPECT_NEAR(w, 1 / 3.0f, 1e-6f) << x;
    } else {
      EXPECT_EQ(w, 0) << x;
    }
  }
}

TEST(LineHypothesis, ExtrapolationToTheImageBorderIsBounded) {
  const PlaneMap map = MakeMap([](int x, int y) { return x >= 60 ? ObliquePlane(x, y) : 0.0f; });
  const Hypotheses hypotheses(AllMeasured(map), Formulas::kRobust);
  const int reach = LineOptions().max_reach;
  for (int x = 0; x < 60; ++x) {
    const float w = hypotheses.state().maps.inverse_depth[kHorizontal](x, 45);
    if (60 - x <= reach) {
      EXPECT_NEAR(w, ObliquePlane(x, 45), 1e-5f) << x;
    } else {
      EXPECT_EQ(w, 0) << x;
    }
  }
}

// Squares of positions in the gap would leave three anchors on its far side no slope in single precision.
TEST(LineHypothesis, TheFarSideOfAWideGapIsAsExactAsTheNearOne) {
  for (const int gap : {100, 2400, 5000, 40000}) {
    for (const Formulas formulas : {Formulas::kRobust, Formulas::kPaper}) {
      // Anchors at the end alone, from there one side of the gap; 0.5 at its last pixel, a step of 0.01 from pixel to pixel.
      Array2D<float> anchors(gap + 3, 1, 0);
      const auto value = [&](int x) { return 0.5f + 0.01f * static_cast<float>(x - (gap - 1)); };
      for (int x = gap; x < gap + 3; ++x) anchors(x, 0) = formulas == Formulas::kPaper ? 1 / value(x) : value(x);
      Array2D<float> filled = anchors;
      const LineOptions options = MakeLineOptions({formulas, {}});
      FillScanline(MakeScanline(kHorizontal, 0, anchors.width(), 1), std::as_const(anchors).view(), {}, options, filled.view());
      for (const int x : {gap - 1, gap - 8}) {
        const float there = formulas == Formulas::kPaper ? 1 / filled(x, 0) : filled(x, 0);
        EXPECT_NEAR(there, value(x), 1e-4f) << gap << ", " << x;
      }
    }
  }
}

TEST(LineHypothesis, ALineAcrossAWideGapMeetsBothSides) {
  constexpr int kGap = 5000;
  Array2D<float> anchors(kGap + 6, 1, 0);
  const auto value = [](int x) { return 0.5f + 1e-5f * static_cast<float>(x); };
  for (int i = 0; i < 3; ++i) {
    anchors(i, 0) = value(i);
    anchors(kGap + 3 + i, 0) = value(kGap + 3 + i);
  }
  Array2D<float> filled = anchors;
  const LineOptions options = MakeLineOptions({Formulas::kPaper, {}});  // whatever the jump, in depth
  Array2D<float> depths = anchors;
  for (float& w : depths) w = w > 0 ? 1 / w : 0;
  FillScanline(MakeScanline(kHorizontal, 0, kGap + 6, 1), std::as_const(depths).view(), {}, options, filled.view());
  for (const int x : {3, 1000, 2500, kGap + 2}) EXPECT_NEAR(1 / filled(x, 0), value(x), 1e-5f) << x;
}

// A step of brightness at x = 80 alone is not even; a measured wall on the left, and on the right in some rows.
TEST(LineHypothesis, WhereTheImageIsEvenALineGoesBetweenTwoSidesOnly) {
  GrayImage image(kWidth, kHeight, 90);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 80; x < kWidth; ++x) image(x, y) = 200;
  }
  // Too few anchors for a plane of the region.
  const PlaneMap map = MakeMap([](int x, int y) {
    return (y == 45 && (x == 40 || x == 60)) || (y == 20 && x == 70) || (y == 70 && x == 81) ? 0.5f : 0.0f;
  });
  const Hypotheses hypotheses = RegionHypotheses(AllMeasured(map), Rules(), image, SharedRegions(image));
  const auto horizontal = [&](int x, int y) { return hypotheses.state().maps.inverse_depth[kHorizontal](x, y); };
  EXPECT_FLOAT_EQ(horizontal(50, 45), 0.5f) << "between two sides";
  EXPECT_EQ(horizontal(39, 45), 0) << "one side, even";
  EXPECT_EQ(horizontal(61, 45), 0);
  EXPECT_EQ(horizontal(71, 20), 0);
  Rules rules;
  rules.Set(Rule::kEvenLines, 0);
  const Hypotheses without = RegionHypotheses(AllMeasured(map), rules, image, SharedRegions(image));
  EXPECT_FLOAT_EQ(without.state().maps.inverse_depth[kHorizontal](39, 45), 0.5f);
}

TEST(LineHypothesis, BesideTextureALineOfOneSideGoesOn) {
  GrayImage image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) image(x, y) = static_cast<float>((x / 4 * 3 + y / 4 * 5) % 7 * 30);
  }
  const PlaneMap map = MakeMap([](int x, int y) { return y == 45 && x == 60 ? 0.5f : 0.0f; });
  const Hypotheses hypotheses = RegionHypotheses(AllMeasured(map), Rules(), image, SharedRegions(image));
  EXPECT_FLOAT_EQ(hypotheses.state().maps.inverse_depth[kHorizontal](59, 45), 0.5f);
}

TEST(LineHypothesis, SingleSideUsesSixPixels) {
  // The paper's anchors are single pixels, so the line through the nearest six is known: depth 1..6 at x = 60..65 has slope 1.
  const PlaneMap map = MakeMap([](int x, int) { return x >= 60 ? 1.0f / (x - 59) : 0.0f; });
  // Three pixels would give the same line; a kink after the third tells six from three.
  PlaneMap kinked = map;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 63; x < kWidth; ++x) kinked(x, y).depth = 3;
  }
  EXPECT_EQ(ValueAt(map, Formulas::kPaper, kHorizontal, 58, 45), 0);  // depth -1 is no hypothesis
  // Least squares of depths (1, 2, 3, 3, 3, 3) at 0..5: mean 2.5, slope 6.5 / 17.5; at -1: 2.5 - 3.5 * 6.5 / 17.5.
  EXPECT_NEAR(1 / ValueAt(kinked, Formulas::kPaper, kHorizontal, 59, 45), 2.5 - 3.5 * 6.5 / 17.5, 1e-4);
}

// One pixel before the gap, and four behind it that are kinked after the third: of six there are five, and all count.
TEST(LineHypothesis, ThePapersLineTakesFromOneSideWhatTheOtherLacks) {
  PlaneMap map(kWidth, kHeight);
  const auto measure = [&](int x, float depth) { map(x, 45) = {{0, 0, -1}, depth}; };
  measure(20, 2);
  for (int x = 30; x < 33; ++x) measure(x, 2);
  measure(33, 6);
  // Depths (2, 2, 2, 2, 6) at (20, 30, 31, 32, 33): means 29.2 and 2.8, slope (3.8 * 4) / 110.8.
  const double mean = 29.2, slope = 3.8 * 4 / 110.8;
  EXPECT_NEAR(1 / ValueAt(map, Formulas::kPaper, kHorizontal, 25, 45), 2.8 + slope * (25 - mean), 1e-4);
}

}  // namespace
}  // namespace phi
