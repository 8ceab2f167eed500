#include "phi/fusion/point_confidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

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

PointSupport SeenUnder(float degrees, PointSupport point) {
  point.least_cosine = std::cos(degrees * std::numbers::pi_v<float> / 180);
  return point;
}

PointTerms TermsOf(const PointSupport& point, const PointDoubts& doubts) {
  PointRater rater;
  rater.Add(point, doubts);
  rater.Rate();
  return rater.TermsOf(0);
}

float ConfidenceOf(const PointSupport& point, const PointDoubts& doubts) {
  PointRater rater;
  rater.Add(point, doubts);
  rater.Rate();
  return rater.ConfidenceOf(0);
}

TEST(PointConfidence, TermsByHand) {
  PointSupport point = SeenUnder(7.7f, Agreeing(3, 1));
  // Two grey images of 90 and two of 110: 10 grey levels from their mean.
  point.brightness_squares = 2 * 270 * 270 + 2 * 330 * 330;
  const PointTerms terms = TermsOf(point, {.num_contradicting = 3, .num_without_depth = 1});
  EXPECT_FLOAT_EQ(terms[kPointMeasured], 2);  // log2(1 + 3)
  EXPECT_FLOAT_EQ(terms[kPointShare], 0.5f);  // 4 of 8
  EXPECT_NEAR(terms[kPointAngle], 3, 1e-5);   // log2(8)
  EXPECT_FLOAT_EQ(terms[kPointBrightness], std::log2(11.0f));
  EXPECT_EQ(TermsOf(Agreeing(2, 0), {})[kPointBrightness], 0);
}

// As many views as there may be, as unlike as they may be: what is squared exceeds 32 bits.
TEST(PointConfidence, BlackAndWhiteImagesOfTheMostViews) {
  PointSupport point;
  point.num_views = kMaxFusionNeighbors;
  for (int& sum : point.rgb_sum) sum = 255 * kMaxFusionNeighbors / 2;
  point.brightness_squares = 765 * 765 * (kMaxFusionNeighbors / 2);
  EXPECT_FLOAT_EQ(TermsOf(point, {})[kPointBrightness], std::log2(1 + 127.5f));
}

TEST(PointConfidence, EachTermCountsTheWayThatItMust) {
  const PointSupport both = SeenUnder(5, Agreeing(2, 2));
  const float some = ConfidenceOf(both, {1, 1});
  EXPECT_GT(some, 0);
  EXPECT_LT(some, 1);
  EXPECT_GT(ConfidenceOf(SeenUnder(5, Agreeing(3, 1)), {1, 1}), some);
  EXPECT_GT(ConfidenceOf(both, {0, 1}), some);
  EXPECT_GT(ConfidenceOf(both, {1, 0}), some);
  EXPECT_GT(ConfidenceOf(SeenUnder(10, Agreeing(2, 2)), {1, 1}), some);
  PointSupport unlike = both;
  unlike.brightness_squares += 4 * 30 * 30;
  EXPECT_LT(ConfidenceOf(unlike, {1, 1}), some);
}

TEST(PointConfidence, WhatAllMeasuredIsSureAndWhatTwoInferredIsNot) {
  EXPECT_GT(ConfidenceOf(SeenUnder(20, Agreeing(8, 0)), {}), 0.95f);
  EXPECT_LT(ConfidenceOf(SeenUnder(0.5f, Agreeing(0, 2)), {6, 2}), 0.35f);
}

// Whatever stands beside it in a vector.
TEST(PointConfidence, APointIsRatedByItself) {
  PointRater rater;
  for (int i = 0; i < PointRater::kSize; ++i) {
    rater.Add(SeenUnder(static_cast<float>(i), Agreeing(1 + i / 2, i % 3)), {static_cast<std::uint16_t>(i % 5), 1});
  }
  rater.Rate();
  for (int i = 0; i < rater.size(); ++i) {
    const std::pair<PointSupport, PointDoubts> alone = {SeenUnder(static_cast<float>(i), Agreeing(1 + i / 2, i % 3)),
                                                        {static_cast<std::uint16_t>(i % 5), 1}};
    EXPECT_EQ(rater.ConfidenceOf(i), ConfidenceOf(alone.first, alone.second));
    EXPECT_EQ(rater.TermsOf(i), TermsOf(alone.first, alone.second));
  }
}

}  // namespace
}  // namespace phi
