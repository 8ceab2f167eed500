#include "phi/filtering/confidence.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "phi/base/array2d.h"
#include "phi/base/box_sums.h"
#include "phi/base/random.h"
#include "phi/filtering/judge_measurements.h"
#include "phi/filtering/own_texture.h"
#include "phi/geometry/depth_precision.h"

namespace phi {
namespace {

constexpr int kSide = 41;
constexpr RayModel kRays{.fx = 100, .fy = 100, .cx = 20.5f, .cy = 20.5f, .width = kSide, .height = kSide};
const DepthPrecision kPrecision(kRays, {});  // no source views: neighbours agree within 0.3 %

PlaneMap Wall() { return {kSide, kSide, {{0, 0, -1}, 3}}; }

// Brightness rises with the square of the distance from the middle column: no plane of brightness.
GrayImage Bowl() {
  GrayImage photo(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) photo(x, y) = static_cast<std::uint8_t>((x - 20) * (x - 20) / 2 + 20);
  }
  return photo;
}

ConfidenceTerms TermsAt(const PlaneMap& estimate, const Array2D<Testimonies>& testimonies, double noise, int x, int y) {
  ConfidenceTerms found = {};
  std::atomic<int> num_told = 0;
  const Mask all(kSide, kSide, 255);
  const Array2D<float> deviations = kPrecision.RelativeDeviations(estimate, all),
                       own_variance = FindOwnTexture(Bowl(), noise).variance;
  const ConfidenceInput input{kRays, estimate, testimonies, all, deviations, own_variance, noise};
  ForConfidenceTerms(input, [&](int u, int v, const ConfidenceTerms& terms) {
    ++num_told;
    if (u == x && v == y) found = terms;
  });
  int num_depths = 0;
  for (const PlaneHypothesis& h : estimate) num_depths += h.depth > 0;
  EXPECT_EQ(num_told, num_depths);
  return found;
}

TEST(Confidence, TermsAreWhatTheyAreNamed) {
  PlaneMap wall = Wall();
  // Of 24 neighbours three pixels apart five are off by 1 %, one has no depth; others nearer by are not asked.
  for (const int dx : {-6, -3, 0, 3, 6}) wall(20 + dx, 14).depth = 3.03f;
  wall(23, 20) = {};
  wall(21, 20).depth = 2;
  Array2D<Testimonies> testimonies(kSide, kSide);
  testimonies(20, 20) = {3, 1, 1};
  const ConfidenceTerms terms = TermsAt(wall, testimonies, 10, 20, 20);
  EXPECT_FLOAT_EQ(terms[kConfirmingShare], 0.75f);
  EXPECT_FLOAT_EQ(terms[kClose], 1);
  EXPECT_FLOAT_EQ(terms[kLoose], std::log2(3.0f));
  EXPECT_FLOAT_EQ(terms[kContradicting], 1);
  EXPECT_EQ(terms[kAnyClose], 1);
  EXPECT_EQ(terms[kTwo], 1);
  EXPECT_FLOAT_EQ(terms[kAgreeingShare], 18 / 24.0f);
  EXPECT_FLOAT_EQ(terms[kFacing], 1);
  EXPECT_FLOAT_EQ(terms[kRelativeDeviation], std::log2(1e-4f));
  const float own = FindOwnTexture(Bowl(), 0).variance(20, 20);
  EXPECT_FLOAT_EQ(terms[kOwnTexture], std::log2(0.02f + own));
  // JPEG leaves 3 of 10 grey levels, and smoothing by 9 pixels a ninth of their variance.
  EXPECT_FLOAT_EQ(terms[kOwnTextureOverNoise], std::log2(0.05f + own / 1.02f));
  const ConfidenceTerms silent = TermsAt(wall, Array2D<Testimonies>(kSide, kSide), 3, 20, 20);
  EXPECT_EQ(silent[kConfirmingShare], 0);
  EXPECT_EQ(silent[kAnyClose], 0);
  EXPECT_EQ(silent[kTwo], 0);
}

// Brightness is 0, 0, 2, 4 at 0, 1, 2, 3 columns from the middle, besides a constant. Means over three columns are 2, 2/3, 0, 2/3, 2
// there: about their mean 16/15 and without a slope the mean square is 0.64.
TEST(OwnTexture, VarianceIsThatOfTheSmoothedSurroundings) { EXPECT_NEAR(FindOwnTexture(Bowl(), 0).variance(20, 20), 0.64, 1e-5); }

// A map that all views confirm and that goes on around the pixel is believed, what half of them contradict or what stands in
// disorder is not.
TEST(Confidence, EvidenceIsWhatViewsAndNeighboursAgreeOn) {
  const auto log_odds = [](float share, float agreeing) {
    ConfidenceTerms terms = {};
    terms[kConfirmingShare] = share;
    terms[kClose] = terms[kContradicting] = 2;
    terms[kAnyClose] = terms[kTwo] = terms[kFacing] = 1;
    terms[kAgreeingShare] = agreeing;
    terms[kOwnTexture] = 2;
    terms[kOwnTextureOverNoise] = 5;
    terms[kRelativeDeviation] = -8;
    return ConfidenceLogOdds(terms);
  };
  EXPECT_GT(log_odds(1, 1), kClueLogOdds);
  EXPECT_LT(log_odds(0.5f, 0.9f), log_odds(1, 0.9f) - 1);
  EXPECT_LT(log_odds(0.2f, 0.5f), kClueLogOdds);
  EXPECT_LT(log_odds(1, 0), kClueLogOdds);
  EXPECT_NEAR(1 / (1 + std::exp(-kClueLogOdds)), 0.8, 1e-6);
}

constexpr double kNoise = 4;

class JudgeMeasurementsTest : public testing::Test {
 protected:
  // A checked photo of a wall: all of it has texture, and the right part of it is plain.
  JudgeMeasurementsTest() : photo_(kSide, kSide) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) photo_(x, y) = x < 30 && (x / 3 + y / 3) % 2 == 0 ? 140 : 100;
    }
    testimonies_ = Array2D<Testimonies>(kSide, kSide, {3, 3, 0});
  }

  PixelState JudgedAt(int x, int y) {
    MeasurementMap map = map_;
    JudgeMeasurements({std::make_shared<const GrayImage>(photo_), kNoise, kPrecision, farthest_, rules_}, estimate_, testimonies_, &map);
    EXPECT_EQ(map.planes(x, y).depth > 0, map.states(x, y) != PixelState::kNone);
    return map.states(x, y);
  }

  GrayImage photo_;
  PlaneMap estimate_ = Wall();
  MeasurementMap map_ = AllMeasured(Wall());
  Array2D<Testimonies> testimonies_;
  float farthest_ = std::numeric_limits<float>::infinity();
  Rules rules_;
};

// The filter asked the views; how probable its depth is changes nothing.
TEST_F(JudgeMeasurementsTest, WhatTheFilterKeptIsMeasuredWhereThereIsTexture) {
  EXPECT_EQ(JudgedAt(15, 20), PixelState::kMeasured);
  testimonies_(15, 20) = {1, 0, 11};
  EXPECT_EQ(JudgedAt(15, 20), PixelState::kMeasured);
}

TEST_F(JudgeMeasurementsTest, WhatIsPlainIsAClueWhereItIsProbable) {
  EXPECT_EQ(JudgedAt(36, 20), PixelState::kClue);
  testimonies_(36, 20) = {1, 0, 11};
  EXPECT_EQ(JudgedAt(36, 20), PixelState::kNone);
}

TEST_F(JudgeMeasurementsTest, WhatTheFilterDroppedIsAClueWhereItIsProbable) {
  map_.Drop(20 * kSide + 15);
  EXPECT_EQ(JudgedAt(15, 20), PixelState::kClue);
  testimonies_(15, 20) = {0, 0, 4};
  EXPECT_EQ(JudgedAt(15, 20), PixelState::kNone);
}

// Of a baseline that tells a depth to 5 %, the wall lies nearer than the search's end by a little less than that, and by a little more.
TEST_F(JudgeMeasurementsTest, WhatCannotBeToldFromTheSearchsEndIsNeitherMeasuredNorAClue) {
  const auto judged = [&](int x, int y, float ratio) {
    const float depth = estimate_(x, y).depth;
    Camera reference, source;
    reference.pinhole = source.pinhole = {kSide, kSide, kRays.fx, kRays.fy, kRays.cx, kRays.cy};
    source.pose.translation = {-kMatchDeviation * depth / (0.05 * kRays.fx), 0, 0};
    MeasurementMap map = map_;
    const auto photo = std::make_shared<const GrayImage>(photo_);
    JudgeMeasurements({photo, kNoise, DepthPrecision(reference, {&source}), depth * ratio, rules_}, estimate_, testimonies_, &map);
    return map.states(x, y);
  };
  for (const int x : {15, 28}) {  // measured; dropped by the filter
    if (x == 28) map_.Drop(20 * kSide + 28);
    EXPECT_EQ(judged(x, 20, 1.049f), PixelState::kNone) << x;
    EXPECT_NE(judged(x, 20, 1.051f), PixelState::kNone) << x;
  }
}

// A random map and photo, judged pixel by pixel as a GPU does it: what is measured, plain, at the search's end, probable or none of these.
class JudgePixelTest : public testing::Test {
 protected:
  JudgePixelTest() {
    reference_.pinhole = {kWidth, kHeight, 70, 72, 33.5, 20};
    for (const double step : {0.3, -0.2}) {
      sources_.push_back(reference_);
      sources_.back().pose.translation = {step, 0.05, 0};
    }
  }

  void MakePixels(int width, int height) {
    photo_ = GrayImage(width, height);
    estimate_ = PlaneMap(width, height);
    kept_ = {estimate_, StateMap(width, height)};
    testimonies_ = Array2D<Testimonies>(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) MakePixel(x, y);
    }
  }

  void MakePixel(int x, int y) {
    const Random4 random = Philox({3, 1}, 0, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
    const auto number = [&](int i, std::uint32_t end) { return static_cast<std::uint8_t>(random.v[i] % end); };
    photo_(x, y) = static_cast<std::uint8_t>(100 + (x / 16 % 2 == 0 ? number(0, 30) : 0));
    const float wall = x / 10 % 3 == 2 ? 5.5f : 3;
    if (number(1, 9) > 0) estimate_(x, y) = {{0.1f, 0, -0.995f}, wall * (1 + 1e-4f * static_cast<float>(number(1, 64)))};
    const bool is_kept = estimate_(x, y).depth > 0 && number(2, 3) > 0;
    if (is_kept) kept_.planes(x, y) = estimate_(x, y);
    kept_.states(x, y) = is_kept ? PixelState::kMeasured : PixelState::kNone;
    const std::uint8_t confirming = number(3, 7);
    testimonies_(x, y) = {confirming, static_cast<std::uint8_t>(number(0, 99) % (confirming + 1)), number(2, 4)};
  }

  // Of each state how many pixels have it.
  std::array<int, 5> ExpectTheSame(const Rules& rules, float farthest) const {
    const Judgement judgement = {std::make_shared<const GrayImage>(photo_), 1.5,
                                 DepthPrecision(reference_, {sources_.data(), &sources_[1]}), farthest, rules};
    MeasurementMap judged = kept_;
    JudgeMeasurements(judgement, estimate_, testimonies_, &judged);
    const Array2D<std::uint16_t> sums = SumBoxes3x3(photo_.view());
    Mask is_plain(photo_.width(), photo_.height());
    JudgementReference j = MakeJudgementReference(judgement);
    j.sources = judgement.precision.sources().data();
    j.estimate = estimate_.view();
    j.sums = sums.view();
    for (int y = 0; y < photo_.height(); ++y) {
      for (int x = 0; x < photo_.width(); ++x) is_plain(x, y) = IsPlain(j, x, y);
    }
    if (rules.IsOn(Rule::kOwnTexture)) j.is_plain = std::as_const(is_plain).view();
    std::array<int, 5> num_of_state = {};
    for (int y = 0; y < photo_.height(); ++y) {
      for (int x = 0; x < photo_.width(); ++x) {
        const auto verdict = kept_.states(x, y) == PixelState::kNone ? FilterVerdict::kDropped : FilterVerdict::kKept;
        const PixelState state = JudgePixel(j, x, y, testimonies_(x, y), verdict);
        EXPECT_EQ(state, judged.states(x, y)) << x << ", " << y;
        ++num_of_state[static_cast<std::size_t>(state)];
      }
    }
    return num_of_state;
  }

  static constexpr int kWidth = 67, kHeight = 41;
  GrayImage photo_;
  PlaneMap estimate_;
  MeasurementMap kept_;
  Array2D<Testimonies> testimonies_;
  Camera reference_;
  std::vector<Camera> sources_;
};

TEST_F(JudgePixelTest, IsTheSamePixelByPixel) {
  MakePixels(kWidth, kHeight);
  const auto expect_same = [&](const Rules& rules, float farthest) {
    const std::array<int, 5> num_of_state = ExpectTheSame(rules, farthest);
    EXPECT_GT(num_of_state[0], 100);
    EXPECT_GT(num_of_state[1], 100);
    EXPECT_EQ(num_of_state[2] > 50, rules.IsOn(Rule::kClues));
  };
  expect_same({}, std::numeric_limits<float>::infinity());
  expect_same({}, 5.52f);
  for (const Rule rule : {Rule::kOwnTexture, Rule::kPlainPatches, Rule::kClues}) {
    Rules rules;
    rules.Set(rule, 0);
    expect_same(rules, 5.52f);
  }
}

// Smaller than a pixel's surroundings, in which nothing is plain.
TEST_F(JudgePixelTest, IsTheSameInAnImageOfFewPixels) {
  for (const auto& [width, height] : {std::pair(4, 7), std::pair(9, 3), std::pair(5, 5)}) {
    MakePixels(width, height);
    EXPECT_GT(ExpectTheSame({}, std::numeric_limits<float>::infinity())[1], 2) << width << "x" << height;
  }
}

TEST_F(JudgeMeasurementsTest, WithoutTheirRulesPlainPixelsAreMeasuredAndNothingIsAClue) {
  rules_.Set(Rule::kOwnTexture, 0);
  EXPECT_EQ(JudgedAt(36, 20), PixelState::kMeasured);
  rules_ = {};
  rules_.Set(Rule::kClues, 0);
  EXPECT_EQ(JudgedAt(36, 20), PixelState::kNone);
}

}  // namespace
}  // namespace phi
