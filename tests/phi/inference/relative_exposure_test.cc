#include "phi/inference/relative_exposure.h"

#include <vector>

#include <gtest/gtest.h>

#include "phi/geometry/camera.h"
#include "tests/support/lens_falloff.h"

namespace phi {
namespace {

using test_support::Darkened;
using test_support::SeenByBoth;

constexpr std::size_t kMinPairs = 100;

RelativeExposure FitOne(const std::vector<SpotPair>& pairs, std::size_t min_num_pairs = kMinPairs) {
  return RelativeExposure::Fit(std::vector<std::vector<SpotPair>>{pairs}, min_num_pairs).at(0);
}

TEST(PhotoFrame, SpotsKnowTheirPlace) {
  // From the middle (20, 15) of 40 x 30 pixels to a corner 25; to the middle of pixel (39, 29) (19.5, 14.5).
  const PhotoFrame frame(Pinhole{40, 30, 50, 50, 20, 15});
  const BrightSpot spot = frame.Spot(39, 29, 7);
  EXPECT_EQ(spot.brightness, 7);
  EXPECT_FLOAT_EQ(spot.squared_radius, (19.5f * 19.5f + 14.5f * 14.5f) / 625);
  EXPECT_FLOAT_EQ(spot.u, 39.5f / 40);
  EXPECT_FLOAT_EQ(spot.v, 29.5f / 30);
  EXPECT_FLOAT_EQ(frame.Spot(0, 0, 0).squared_radius, spot.squared_radius);
  EXPECT_FLOAT_EQ(frame.Spot(19, 14, 0).squared_radius, 0.5f / 625);
}

TEST(RelativeExposure, FindsGainAndBothFalloffs) {
  const std::vector<SpotPair> pairs = SeenByBoth(16000, 1.3, 0.4, 0.2);
  const RelativeExposure exposure = FitOne(pairs);
  EXPECT_NEAR(exposure.gain(), 1.3, 0.02);
  for (const SpotPair& pair : pairs) ASSERT_NEAR(exposure.Change(pair.reference, pair.source), 0, 1.5);
  // 20 grey levels more than the same surface would have in the reference's corner: 1.3 * 100 / 1.2^2 = 90.3.
  EXPECT_NEAR(exposure.Change({110.3f, 1}, {100, 0}), 20, 1.5);
  // The gain alone would be off by 40.
  EXPECT_NEAR(RelativeExposure(1.3f).Change({110.3f, 1}, {100, 0}), -19.7f, 1e-3f);
}

// One source sees everything at one radius of the reference and cannot tell its falloff; the other can.
TEST(RelativeExposure, AllSourcesTellOfTheReferencesFalloff) {
  std::vector<std::vector<SpotPair>> pairs = {SeenByBoth(4000, 1.2, 0.4, 0), SeenByBoth(16000, 0.9, 0.4, 0.3)};
  for (SpotPair& pair : pairs[0]) {
    pair.reference.brightness *= static_cast<float>(Darkened(0.5, 0.4) / Darkened(pair.reference.squared_radius, 0.4));
    pair.reference.squared_radius = 0.5f;
  }
  const std::vector<RelativeExposure> exposures = RelativeExposure::Fit(pairs, kMinPairs);
  EXPECT_NEAR(exposures[0].gain(), 1.2, 0.02);
  EXPECT_NEAR(exposures[1].gain(), 0.9, 0.02);
  EXPECT_NEAR(exposures[0].Change({83.33f, 1}, {100, 0}), 0, 2);  // 1.2 * 100 / 1.2^2
}

TEST(RelativeExposure, MistakenSpotsDoNotMatter) {
  std::vector<SpotPair> pairs = SeenByBoth(16000, 0.8, 0.3, 0.3);
  const std::vector<SpotPair> right = pairs;
  for (std::size_t i = 0; i < pairs.size(); i += 5) pairs[i].reference.brightness += 60;
  const RelativeExposure exposure = FitOne(pairs);
  for (const SpotPair& pair : right) ASSERT_NEAR(exposure.Change(pair.reference, pair.source), 0, 3);
}

TEST(RelativeExposure, FewSpotsTellNothing) {
  const std::vector<SpotPair> pairs = SeenByBoth(99, 1.5, 0.3, 0.3);
  EXPECT_EQ(FitOne(pairs).gain(), 1);
  EXPECT_EQ(FitOne({}, 0).gain(), 1);
}

TEST(RelativeExposure, WhereNoFalloffShowsThereIsNone) {
  // All spots lie at one radius: gain and falloff cannot be told apart.
  std::vector<SpotPair> pairs = SeenByBoth(200, 1.2, 0, 0);
  for (SpotPair& pair : pairs) pair.reference.squared_radius = pair.source.squared_radius = 0.3f;
  const RelativeExposure exposure = FitOne(pairs);
  EXPECT_NEAR(exposure.gain(), 1.2, 0.01);
  EXPECT_NEAR(exposure.Change({120, 1}, {100, 0}), 0, 1);
}

TEST(RelativeExposure, WhatIsCutOffAtWhiteIsNotUnlike) {
  const RelativeExposure brighter(1.5f), darker(0.5f);
  EXPECT_EQ(brighter.Change({255, 0}, {200, 0}), 0);        // would be 300
  EXPECT_FLOAT_EQ(brighter.Change({240, 0}, {200, 0}), -60);
  EXPECT_EQ(darker.Change({180, 0}, {255, 0}), 0);          // may be brighter than 255
  EXPECT_FLOAT_EQ(darker.Change({100, 0}, {255, 0}), -27.5f);  // but not darker
}

TEST(RelativeExposure, OfOneImageKnowsItsFalloff) {
  std::vector<RelativeExposure> exposures;
  for (const double source_falloff : {0.0, 0.2, 0.4})
    exposures.push_back(FitOne(SeenByBoth(16000, 1 + source_falloff, 0.4, source_falloff)));
  const RelativeExposure own = RelativeExposure::OfOneImage(exposures);
  EXPECT_EQ(own.gain(), 1);
  EXPECT_NEAR(own.Change({100, 1}, {144, 0}), 0, 2);  // 144 / 1.2^2
  EXPECT_EQ(RelativeExposure::OfOneImage({}).Change({120, 1}, {100, 0}), 20);
}

}  // namespace
}  // namespace phi
