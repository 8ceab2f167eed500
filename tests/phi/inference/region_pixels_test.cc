// A plain image is one region; its anchors lie on a wall but for a patch at a shelf's depth.
#include "phi/inference/region_pixels.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "tests/support/centered_view.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 160, kHeight = 120;

float Wall(int x, int) { return 0.3f + 0.001f * static_cast<float>(x); }
bool OnRim(int x, int y) { return x < 8 || y < 8 || x >= kWidth - 8 || y >= kHeight - 8; }
// 0.25 % before the wall is within what an anchor on it may err by, 0.4 % is not.
float Measured(int x, int y) {
  if (!OnRim(x, y)) return 0;
  if (y < 4) return Wall(x, y) * (x < 20 ? 1.25f : x < 30 ? 1.004f : x < 40 ? 0.996f : x < 50 ? 1.0025f : 1.0f);
  return Wall(x, y);
}

struct Finished {
  MeasurementMap map{PlaneMap(kWidth, kHeight), StateMap(kWidth, kHeight)};

  explicit Finished(const Rules& rules = {}, int region_edge = kWidth, bool keeps_measured = false) {
    GrayImage image(kWidth, kHeight, 120);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = region_edge; x < kWidth; ++x) image(x, y) = (x / 6 + y / 6) % 2 == 0 ? 20 : 220;
    }
    Array2D<float> anchors(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        anchors(x, y) = Measured(x, y);
        if (!OnRim(x, y)) continue;
        map.planes(x, y) = {{0, 0, -1}, 1 / anchors(x, y)};
        map.states(x, y) = PixelState::kMeasured;
      }
    }
    const SceneView view = test_support::CenteredView(3, kWidth, kHeight, 150);
    InferenceInput input;
    input.reference = {&view, std::make_shared<const GrayImage>(image)};
    input.keeps_measured = keeps_measured;
    FinishRegionPixels(RegionPlanes(SharedRegions(image), std::as_const(anchors).view(), 3), input, rules, &map);
  }

  // Inverse depth there over the wall's.
  float Ratio(int x, int y) const { return 1 / map.planes(x, y).depth / Wall(x, y); }
};

TEST(RegionPixels, AMeasurementOffTheRegionsPlaneTakesIt) {
  const Finished finished;
  for (const int x : {10, 25, 35}) {
    EXPECT_EQ(finished.map.states(x, 2), PixelState::kInferredAlone) << x;
    EXPECT_NEAR(finished.Ratio(x, 2), 1, 2e-4) << x;
    EXPECT_LT(finished.map.planes(x, 2).normal.x, -0.05f) << "the plane's normal";
  }
  // What an anchor may err by, it keeps.
  for (const int x : {45, 100}) EXPECT_EQ(finished.map.states(x, 2), PixelState::kMeasured) << x;
  EXPECT_FLOAT_EQ(finished.Ratio(45, 2), 1.0025f);
}

TEST(RegionPixels, OutsideARegionWhatWasMeasuredStays) {
  const Finished finished({}, 0);
  EXPECT_EQ(finished.map.states(10, 2), PixelState::kMeasured);
  EXPECT_FLOAT_EQ(finished.Ratio(10, 2), 1.25f);
}

TEST(RegionPixels, WhatAnotherProgramMeasuredStays) {
  const Finished finished({}, kWidth, true);
  EXPECT_EQ(finished.map.states(10, 2), PixelState::kMeasured);
  EXPECT_FLOAT_EQ(finished.Ratio(10, 2), 1.25f);
}

TEST(RegionPixels, WithoutTheRuleItStays) {
  Rules rules;
  rules.Set(Rule::kEdgeDepths, 0);
  const Finished finished(rules);
  EXPECT_EQ(finished.map.states(10, 2), PixelState::kMeasured);
  EXPECT_FLOAT_EQ(finished.Ratio(10, 2), 1.25f);
}

TEST(RegionPixels, AMeasurementWhoseCorrectionWasNotConfirmedIsRestored) {
  constexpr PixelState kNone = PixelState::kNone, kMeasured = PixelState::kMeasured, kAlone = PixelState::kInferredAlone;
  struct Case {
    PixelState measured, inferred, filtered, result;
    int min_num_consistent = 1;
  };
  const Case cases[] = {{kMeasured, kAlone, kNone, kMeasured},
                        {kMeasured, PixelState::kInferredConfirmed, kNone, kMeasured},
                        {kMeasured, kAlone, kAlone, kAlone},        // confirmed
                        {kMeasured, kAlone, kAlone, kMeasured, 0},  // nobody was asked
                        {PixelState::kClue, kAlone, kAlone, kAlone, 0},
                        {kMeasured, kNone, kNone, kNone},           // the sky's rim
                        {PixelState::kClue, kAlone, kNone, kNone},  // a hole
                        {kNone, kAlone, kNone, kNone}};
  for (const Case& c : cases) {
    const auto map_of = [](PixelState state, float depth) {
      MeasurementMap map{PlaneMap(1, 1), StateMap(1, 1, state)};
      if (state != PixelState::kNone) map.planes(0, 0) = {{0, 0, -1}, depth};
      return map;
    };
    MeasurementMap filtered = map_of(c.filtered, 3);
    RestoreMeasured(map_of(c.measured, 2), StateMap(1, 1, c.inferred), c.min_num_consistent, &filtered);
    EXPECT_EQ(filtered.states(0, 0), c.result);
    EXPECT_EQ(filtered.planes(0, 0).depth, c.result == kMeasured ? 2 : c.result == kAlone ? 3 : 0);
  }
}

}  // namespace
}  // namespace phi
