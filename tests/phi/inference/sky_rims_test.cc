#include "phi/inference/sky_rims.h"

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "phi/inference/region_pixels.h"
#include "tests/support/centered_view.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 160, kHeight = 120, kSky = 100;  // the first column of the sky

// A shaded wall, and the sky of one brightness. The wall is measured at both sides, and of the sky the first so many columns with it.
struct Roof {
  SceneView view = test_support::CenteredView(1, kWidth, kHeight, 150);
  GrayImage image = GrayImage(kWidth, kHeight, 180);
  MeasurementMap map{PlaneMap(kWidth, kHeight), StateMap(kWidth, kHeight)};

  explicit Roof(int num_columns) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kSky + num_columns; ++x) {
        if (x < kSky) image(x, y) = static_cast<std::uint8_t>(50 + x);
        if (x >= 10 && x < 90) continue;
        map.planes(x, y) = {{0, 0, -1}, 3};
        map.states(x, y) = PixelState::kMeasured;
      }
    }
  }

  void Finish(const Rules& rules = {}, bool keeps_measured = false) {
    InferenceInput input;
    input.reference = {&view, std::make_shared<const GrayImage>(image)};
    input.keeps_measured = keeps_measured;
    Array2D<float> anchors(kWidth, kHeight);
    for (std::size_t i = 0; i < map.size(); ++i) anchors.data()[i] = IsPublished(map.states.data()[i]) ? 1 / map.planes.data()[i].depth : 0;
    PlaneEvidence evidence;
    evidence.views.emplace(input, std::vector<RelativeExposure>());
    const RegionPlanes planes(SharedRegions(image, rules), std::as_const(anchors).view(), 1, evidence, rules);
    FinishRegionPixels(planes, input, rules, &map);
  }

  bool IsThere(int x) const {
    EXPECT_EQ(IsPublished(map.states(x, 60)), map.planes(x, 60).depth > 0);
    return IsPublished(map.states(x, 60));
  }
};

TEST(SkyRims, DepthsOnTheSkyGo) {
  Roof roof(3);
  roof.map.states(kSky + 1, 60) = PixelState::kInferredAlone;
  roof.Finish();
  EXPECT_TRUE(roof.IsThere(kSky - 1));
  for (int x = kSky; x < kSky + 3; ++x) EXPECT_FALSE(roof.IsThere(x)) << x;
}

TEST(SkyRims, AsFarAsTheSkyIsSeenNear) {
  Roof roof(9);
  roof.Finish();
  EXPECT_TRUE(roof.IsThere(kSky + 3)) << "six pixels from what has no depth";
  EXPECT_FALSE(roof.IsThere(kSky + 4));
}

// A wire of one pixel, and its rims.
TEST(SkyRims, WhatIsUnlikeTheSkyStays) {
  for (const int change : {6, 7, -7, -100}) {
    Roof roof(0);
    for (int y = 0; y < kHeight; ++y) {
      roof.image(130, y) = static_cast<std::uint8_t>(180 + change);
      for (int x = 128; x <= 132; ++x) {
        roof.map.planes(x, y) = {{0, 0, -1}, 2};
        roof.map.states(x, y) = PixelState::kMeasured;
      }
    }
    roof.Finish();
    EXPECT_EQ(roof.IsThere(130), change != 6) << change;
    EXPECT_FALSE(roof.IsThere(128)) << change;
    EXPECT_FALSE(roof.IsThere(132)) << change;
  }
}

TEST(SkyRims, BesideAWallTheyStay) {
  Roof roof(3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = kSky; x < kWidth; ++x) roof.image(x, y) = static_cast<std::uint8_t>(100 + x);
  }
  roof.Finish();
  EXPECT_TRUE(roof.IsThere(kSky + 1));
}

TEST(SkyRims, WhatAnotherProgramMeasuredStaysAndWithoutTheRule) {
  Roof others(3), off(3);
  others.Finish({}, true);
  EXPECT_TRUE(others.IsThere(kSky + 1));
  Rules rules;
  rules.Set(Rule::kSkyRims, 0);
  off.Finish(rules);
  EXPECT_TRUE(off.IsThere(kSky + 1));
}

}  // namespace
}  // namespace phi
