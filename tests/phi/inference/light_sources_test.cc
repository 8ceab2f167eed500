#include "phi/inference/light_sources.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "phi/inference/hypotheses.h"
#include "phi/inference/region_planes.h"
#include "tests/support/centered_view.h"
#include "tests/support/lens_falloff.h"
#include "tests/support/region_hypotheses.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 160, kHeight = 120, kPane = 100;  // the first column of the pane

// By column and row, grey levels.
using Brightness = std::function<int(int, int)>;

int ShadedWall(int x, int) { return 50 + x; }  // 50 to 149
Brightness Even(int level) {
  return [level](int, int) { return level; };
}

// A wall beside a pane.
struct Room {
  SceneView view = test_support::CenteredView(1, kWidth, kHeight, 150);
  InferenceInput input;
  std::vector<RelativeExposure> exposures;

  Room(const Brightness& wall, const Brightness& pane) {
    auto image = std::make_shared<GrayImage>(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) (*image)(x, y) = static_cast<std::uint8_t>((x < kPane ? wall : pane)(x, y));
    }
    input.reference = {&view, image};
  }

  // Of the wall and the pane, of which the first so many spots are asked.
  std::vector<bool> Sources(const Rules& rules = {}, std::size_t num_on_wall = 1000, std::size_t num_on_pane = 1000) const {
    const SpotGrid grid(kWidth, kHeight);
    std::vector<std::vector<Spot>> regions(2);
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Spot spot = grid.At(column, row);
        if (spot.x < kPane - 3 || (spot.x >= kPane + 3 && spot.x < kWidth - 3)) regions[spot.x < kPane ? 0 : 1].push_back(spot);
      }
    }
    regions[0].resize(std::min(num_on_wall, regions[0].size()));
    regions[1].resize(std::min(num_on_pane, regions[1].size()));
    return FindLightSources(regions, grid, SpotViews(input, exposures), rules);
  }
  bool PaneShines() const { return Sources()[1]; }
};

TEST(LightSources, APaneBesideAShadedWallIsOne) {
  EXPECT_EQ(Room(ShadedWall, Even(180)).Sources(), (std::vector{false, true}));
}

// Of 26 columns of spots 17 lie on the wall, 53 to 149 grey levels bright, the 13th 125 and the next 131.
TEST(LightSources, WhatIsDarkerThanHalfOfTheImageIsNone) {
  EXPECT_FALSE(Room(ShadedWall, Even(90)).PaneShines()) << "a screen that is off";
  EXPECT_FALSE(Room(ShadedWall, Even(128)).PaneShines());
  EXPECT_TRUE(Room(ShadedWall, Even(132)).PaneShines());
}

// Of the pane's columns the middle eight tenths count: 5.6 and 7 grey levels of 183.
TEST(LightSources, WhatHasShadeIsNone) {
  const auto ramp = [](int columns_a_level) { return [=](int x, int) { return 180 + (x - kPane) / columns_a_level; }; };
  EXPECT_TRUE(Room(ShadedWall, ramp(10)).PaneShines());
  EXPECT_FALSE(Room(ShadedWall, ramp(7)).PaneShines());
  EXPECT_FALSE(Room(ShadedWall, ShadedWall).PaneShines());
}

// Eight tenths of a hundred columns, 20 levels of 150: a shade of 0.11, an eighth of which is 0.013, 2.4 levels of the pane.
TEST(LightSources, WhereWallsHaveLittleShadeItHasStillLess) {
  const Brightness sunny = [](int x, int) { return 140 + x / 5; };
  EXPECT_TRUE(Room(sunny, Even(180)).PaneShines());
  EXPECT_TRUE(Room(sunny, [](int x, int) { return 180 + (x - kPane) / 30; }).PaneShines());
  EXPECT_FALSE(Room(sunny, [](int x, int) { return 180 + (x - kPane) / 14; }).PaneShines());
}

TEST(LightSources, WhereAllIsEvenNoneIs) { EXPECT_EQ(Room(Even(120), Even(180)).Sources(), (std::vector{false, false})); }

TEST(LightSources, FewSpotsAreNotJudged) {
  const Room room(ShadedWall, Even(180));
  EXPECT_TRUE(room.Sources({}, 1000, 16)[1]);
  EXPECT_FALSE(room.Sources({}, 1000, 15)[1]);
}

TEST(LightSources, WhatFillsMostOfTheEvenRegionsIsNotJudged) {
  const Room room(ShadedWall, Even(180));
  EXPECT_TRUE(room.Sources({}, 101, 100)[1]);
  EXPECT_FALSE(room.Sources({}, 100, 100)[1]);
}

TEST(LightSources, WhatMayBeCutOffAtWhiteIsNotJudged) {
  EXPECT_TRUE(Room(ShadedWall, Even(244)).PaneShines());
  EXPECT_FALSE(Room(ShadedWall, Even(245)).PaneShines());
}

// The pane reaches from 0.09 to 1 of the squared radius, so that its corners are darker by the lens's falloff of 0.3 alone.
TEST(LightSources, TheLensIsNoShade) {
  const PhotoFrame frame(test_support::CenteredView(1, kWidth, kHeight, 150).camera.pinhole);
  Room room(ShadedWall, [&](int x, int y) { return static_cast<int>(200 * test_support::Darkened(frame.Spot(x, y, 0).squared_radius, 0.3) + 0.5); });
  EXPECT_FALSE(room.PaneShines());
  room.exposures = RelativeExposure::Fit(std::vector<std::vector<SpotPair>>{test_support::SeenByBoth(16000, 1, 0.3, 0.3)}, 100);
  EXPECT_TRUE(room.PaneShines());
}

TEST(LightSources, TheRuleScales) {
  const Room room(ShadedWall, [](int x, int) { return 180 + (x - kPane) / 10; });
  Rules rules;
  rules.Set(Rule::kLightSources, 0.7);
  EXPECT_FALSE(room.Sources(rules)[1]);
  rules.Set(Rule::kLightSources, 0);
  EXPECT_FALSE(Room(ShadedWall, Even(180)).Sources(rules)[1]);
}

// Both sides of the wall are measured, and of the pane two columns at either side.
TEST(LightSources, TakeNeitherPlaneNorLine) {
  const Room room(ShadedWall, Even(180));
  const float w = 0.3f;
  PlaneMap planes(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (x < 10 || (x >= 90 && x < kPane + 2) || x >= kWidth - 2) planes(x, y) = {{0, 0, -1}, 1 / w};
    }
  }
  const MeasurementMap measured = AllMeasured(std::move(planes));
  const auto offered = [&](float factor) {
    Rules rules;
    rules.Set(Rule::kLightSources, factor);
    PlaneEvidence evidence;
    evidence.views.emplace(room.input, room.exposures);
    evidence.states = std::as_const(measured.states).view();
    const GrayImage& image = *room.input.reference.image;
    const Hypotheses hypotheses = RegionHypotheses(measured, rules, image, SharedRegions(image, rules), 1, evidence);
    const auto& maps = hypotheses.state().maps.inverse_depth;
    return std::vector{maps[kHorizontal](130, 60), maps[kDescending](130, 60)};
  };
  EXPECT_NEAR(offered(0)[0], w, 1e-4f) << "a line from side to side";
  EXPECT_NEAR(offered(0)[1], w, 1e-4f) << "the region's plane";
  EXPECT_EQ(offered(1), (std::vector{0.0f, 0.0f}));
}

}  // namespace
}  // namespace phi
