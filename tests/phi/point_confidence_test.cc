#include "phi/fusion/point_confidence.h"

#include <gtest/gtest.h>

#include <cmath>

namespace phi {
namespace {

// Images of one brightness that agree.
PointSupport Agreeing(int num_measured, int num_inferred) {
  PointSupport point;
  point.num_views = num_measured + num_inferred;
  point.num_inferred = num_inferred;
  for (int& sum : point.rgb_sum) sum = 100 * point.num_views;
  point.brightness_squares = 300 * 300 * point.num_views;
  return point;
}

TEST(PointConfidence, TermsByHand) {
  PointSupport point = Agreeing(3, 1);
  // Two grey images of 90 and two of 110: 10 grey levels from their mean.
  point.brightness_squares = 2 * 270 * 270 + 2 * 330 * 330;
  const PointTerms terms = MakePointTerms(point, {.num_contradicting = 3, .num_without_depth = 1}, 7.7f);
  EXPECT_FLOAT_EQ(terms[kPointMeasured], 2);  // log2(1 + 3)
  EXPECT_FLOAT_EQ(terms[kPointShare], 0.5f);  // 4 of 8
  EXPECT_FLOAT_EQ(terms[kPointAngle], 3);     // log2(8)
  EXPECT_FLOAT_EQ(terms[kPointBrightness], std::log2(11.0f));
  EXPECT_EQ(MakePointTerms(Agreeing(2, 0), {}, 1)[kPointBrightness], 0);
}

TEST(PointConfidence, EachTermCountsTheWayThatItMust) {
  const auto confidence = [](const PointSupport& point, const PointDoubts& doubts, float angle) {
    return PointConfidence(MakePointTerms(point, doubts, angle));
  };
  const float some = confidence(Agreeing(2, 2), {1, 1}, 5);
  EXPECT_GT(some, 0);
  EXPECT_LT(some, 1);
  EXPECT_GT(confidence(Agreeing(3, 1), {1, 1}, 5), some);
  EXPECT_GT(confidence(Agreeing(2, 2), {0, 1}, 5), some);
  EXPECT_GT(confidence(Agreeing(2, 2), {1, 0}, 5), some);
  EXPECT_GT(confidence(Agreeing(2, 2), {1, 1}, 10), some);
  PointSupport unlike = Agreeing(2, 2);
  unlike.brightness_squares += 4 * 30 * 30;
  EXPECT_LT(confidence(unlike, {1, 1}, 5), some);
}

TEST(PointConfidence, WhatAllMeasuredIsSureAndWhatTwoInferredIsNot) {
  EXPECT_GT(PointConfidence(MakePointTerms(Agreeing(8, 0), {}, 20)), 0.95f);
  EXPECT_LT(PointConfidence(MakePointTerms(Agreeing(0, 2), {6, 2}, 0.5f)), 0.3f);
}

}  // namespace
}  // namespace phi
