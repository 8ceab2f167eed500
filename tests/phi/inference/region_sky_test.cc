#include "phi/inference/region_sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "phi/inference/hypotheses.h"
#include "phi/inference/region_planes.h"
#include "tests/phi/inference/above_a_roof.h"
#include "tests/support/centered_view.h"
#include "tests/support/region_hypotheses.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

// What the region above the roof is if it is not on the roof's plane.
Sky JudgeAboveARoof(const AboveARoof& scene, double min_unlike) {
  const SpotViews views(scene.input, std::array<RelativeExposure, 2>());
  return RegionSky(scene.spots, &views, {.min_unlike = min_unlike}).Judge(kRoof, [&] { return scene.roof; });
}

// A floor with the horizon at y = 20: what lies at 110 is a third as far as what lies at 50, and a spot there a 27th of the surface.
TEST(RegionSky, TheSkyIsCountedBySurface) {
  const ImagePlane floor{-0.2, 0, 0.01};
  const AboveARoof plain(100, 100);
  const SpotViews views(plain.input, std::array<RelativeExposure, 2>());
  // Of ten rows of spots so many are at `y`, the others at `other`.
  const auto judge = [&](const std::vector<AnchorCell>& cells, int num_rows, int y, int other) {
    std::vector<Spot> spots;
    for (int x = 15; x < 145; x += 10) {
      for (int row = 0; row < 10; ++row) spots.push_back({x, row < num_rows ? y : other});
    }
    return RegionSky(spots, &views, {.min_unlike = 0.25}).Judge(floor, [&] { return cells; });
  };
  // Before cells that are far away lies little floor, though it fills most of the image: 1 of 1 + 9 / 27.
  const std::vector<AnchorCell> far = CellsOn(floor, 0, 160, 40, 70);
  EXPECT_EQ(judge(far, 1, 50, 110), Sky::kNot);
  // Behind near ones lies much: 4 of 4 + 6 * 27.
  const std::vector<AnchorCell> near = CellsOn(floor, 0, 160, 90, 130);
  EXPECT_EQ(judge(near, 4, 110, 50), Sky::kSeen);
  // Above the horizon it has no end.
  EXPECT_EQ(judge(near, 9, 110, 15), Sky::kSeen);
}

// The roof's slant is across the columns, so that each row of spots has the same surface: two of five lie on the roof.
TEST(RegionSky, WhatLooksTheSameInfinitelyFarIsTheSky) {
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(100, 100), 0.6), Sky::kSeen);
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(100, 100), 0.4 - 1e-9), Sky::kNot) << "as much as lies between cells";
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(100, 100), 0), Sky::kNot) << "not asked";
}

// An even region that ends at a darker house at x = 100, and a source camera half a metre to the right. If the region is the wall that
// cells lie on all around it, the camera sees the house in the direction of its last 36 spots: 0.5 * 150 * 0.365 / 0.925 = 29.6 pixels
// are too few for those at x = 65, 30.4 are enough at x = 75.
struct BesideAHouse {
  SceneView reference = test_support::CenteredView(1, 160, 120, 150), source = test_support::CenteredView(2, 160, 120, 150);
  InferenceInput input;
  ImagePlane wall{0.3, 0.001, 0};
  std::vector<Spot> spots;

  // `num_rows`: of spots. In `num_dark` of them the camera sees the house there.
  BesideAHouse(int num_rows, int num_dark) {
    auto with_house = std::make_shared<GrayImage>(160, 120, 100), from_right = std::make_shared<GrayImage>(*with_house);
    for (int y = 0; y < 120; ++y) {
      std::fill(&(*with_house)(100, y), &(*with_house)(0, y) + 160, 60);
      if (y < 10 * num_dark) std::fill(&(*from_right)(70, y), &(*from_right)(0, y) + 160, 60);
    }
    source.camera.pose.translation = {-0.5, 0, 0};
    input.reference = {&reference, with_house};
    input.sources = {{&source, from_right}};
    input.source_depths = {std::make_shared<const MeasuredDepths>(AllMeasured(DepthMap(160, 120)))};
    for (int row = 0; row < num_rows; ++row) {
      for (int x = 5; x < 100; x += 10) spots.push_back({x, 10 * row + 5});
    }
  }

  Sky Judge(double min_foretold) const {
    const SpotViews views(input, std::array<RelativeExposure, 1>());
    return RegionSky(spots, &views, {0.6, min_foretold}).Judge(wall, [&] { return CellsOn(wall, 0, 160, 0, 130); });
  }
};

TEST(RegionSky, WhatDoesNotMoveAsItsPlaneForetellsIsTheSky) {
  EXPECT_EQ(BesideAHouse(12, 5).Judge(0.5), Sky::kSeen) << "15 of 36";
  EXPECT_EQ(BesideAHouse(12, 6).Judge(0.5), Sky::kNot) << "18 of 36";
  EXPECT_EQ(BesideAHouse(12, 6).Judge(0.5 + 1e-9), Sky::kSeen);
  EXPECT_EQ(BesideAHouse(12, 0).Judge(0), Sky::kNot) << "not asked";
}

TEST(RegionSky, FewForetoldSpotsSayNothing) {
  EXPECT_EQ(BesideAHouse(6, 0).Judge(0.5), Sky::kSeen) << "18";
  EXPECT_EQ(BesideAHouse(5, 0).Judge(0.5), Sky::kNot) << "15";
}

TEST(RegionSky, CellsAreSoughtWhereTheSpotsDoNotDecide) {
  const auto num_sought = [](const BesideAHouse& scene, const SkyLimits& limits) {
    const SpotViews views(scene.input, std::array<RelativeExposure, 1>());
    int num = 0;
    const auto cells_on = [&] {
      ++num;
      return std::vector<AnchorCell>();
    };
    RegionSky(scene.spots, &views, limits).Judge(scene.wall, cells_on);
    return num;
  };
  EXPECT_EQ(num_sought(BesideAHouse(12, 6), {0.6, 0.5}), 1);
  EXPECT_EQ(num_sought(BesideAHouse(12, 5), {0.6, 0.5}), 0) << "it is the sky";
  EXPECT_EQ(num_sought(BesideAHouse(12, 6), {0, 0.5}), 0) << "they are not asked";
}

// Cells all over the sky, on the roof's plane.
TEST(RegionSky, CluesSayNothingAgainstTheSky) {
  AboveARoof scene(100, 100);
  std::vector<AnchorCell> sky = CellsOn(kRoof, 0, 160, 0, 60);
  scene.roof.insert(scene.roof.end(), sky.begin(), sky.end());
  EXPECT_EQ(JudgeAboveARoof(scene, 0.6), Sky::kNot) << "measured";
  for (AnchorCell& cell : scene.roof) cell.is_measured = cell.y >= 60;
  EXPECT_EQ(JudgeAboveARoof(scene, 0.6), Sky::kSeen);
  EXPECT_EQ(JudgeAboveARoof(scene, 0.4 - 1e-9), Sky::kNot) << "what lies between measured cells counts as before";
  for (AnchorCell& cell : scene.roof) cell.is_measured = false;
  EXPECT_EQ(JudgeAboveARoof(scene, 1e-9), Sky::kSeen);
  EXPECT_EQ(JudgeAboveARoof(scene, 0), Sky::kNot) << "not asked";
}

// The sources show the sky's left half with another brightness: both, or one of the two.
TEST(RegionSky, WhatMovesFromViewToViewIsNoSky) {
  double left = 0, all = 0;
  for (int x = 15; x < 145; x += 10) {
    const double area = std::pow(kRoof.InverseDepth(x, 0), -3);
    all += area;
    if (x < 70) left += area;
  }
  const double both = 0.4 + 0.6 * left / all, one = 0.4 + 0.3 * left / all;
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(60, 60), both - 1e-9), Sky::kNot);
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(60, 60), both + 1e-9), Sky::kSeen);
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(60, 100), one - 1e-9), Sky::kNot);
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(60, 100), one + 1e-9), Sky::kSeen);
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(106, 106), 0.4 - 1e-9), Sky::kNot);
  EXPECT_EQ(JudgeAboveARoof(AboveARoof(106, 106), 0.6), Sky::kSeen) << "six grey levels are no other brightness";
}

// What a plane of the roof would leave: the sky, something that may be the sky, or neither.
Sky LeftAboveARoof(AboveARoof scene, const std::vector<int>& rows, int end = 145) {
  scene.spots.clear();
  for (const int y : rows) {
    for (int x = 15; x < end; x += 10) scene.spots.push_back({x, y});
  }
  return JudgeAboveARoof(scene, 0.6);
}

TEST(RegionSky, WithTooLittleOnTheRoofItIsTheSky) {
  const AboveARoof scene(100, 100);
  EXPECT_EQ(LeftAboveARoof(scene, {5, 15, 25, 35, 75, 85, 95}), Sky::kSeen) << "3 of 7";
  EXPECT_EQ(LeftAboveARoof(scene, {5, 75, 85}), Sky::kNot) << "2 of 3";
}

// A camera may show the sky brighter than another one by more than their gain. Then it shows it so at the roof's depth as well.
TEST(RegionSky, ViewsThatShowTheRegionAlikeNowhereTellNothing) {
  AboveARoof scene(100, 100);
  const auto brighter_above = [&](int end) {
    auto image = std::make_shared<GrayImage>(160, 120, std::uint8_t{100});
    std::fill(image->data(), &(*image)(0, end), 140);
    for (ViewImage& source : scene.input.sources) source.image = image;
    return scene;
  };
  EXPECT_EQ(LeftAboveARoof(brighter_above(60), {5, 15, 25}), Sky::kMayBe) << "no view shows it";
  EXPECT_EQ(LeftAboveARoof(brighter_above(10), {5, 15}), Sky::kSeen) << "half of it is shown";
  EXPECT_EQ(LeftAboveARoof(brighter_above(20), {5, 15, 25}), Sky::kMayBe) << "a third";
  EXPECT_EQ(LeftAboveARoof(brighter_above(20), {5, 15, 25, 75, 85}), Sky::kMayBe) << "what lies on the roof is not asked";
}

// The sources show all of it brighter, but for the spots of some rows: on the roof's plane, or infinitely far away. Up to column 85
// no spot's place on the plane is another's infinitely far away.
Sky LeftWhereShown(const std::vector<int>& rows, std::size_t num_on_plane, std::size_t num_far) {
  AboveARoof scene(100, 100);
  for (int j = 0; j < 2; ++j) {
    auto image = std::make_shared<GrayImage>(160, 120, std::uint8_t{140});
    for (std::size_t i = 0; i < num_on_plane + num_far; ++i) {
      for (int x = 15; x < 90; x += 10) {
        const double moved = i < num_on_plane ? (j == 0 ? -0.5 : 0.5) * 150 * kRoof.InverseDepth(x, rows[i]) : 0;
        const int u = static_cast<int>(std::floor(x + 0.5 + moved));
        if (u >= 0 && u < 160) (*image)(u, rows[i]) = 100;
      }
    }
    scene.input.sources[j].image = image;
  }
  return LeftAboveARoof(scene, rows, 90);
}

TEST(RegionSky, WhatViewsShowOnThePlaneIsNotLeftOpen) {
  EXPECT_EQ(LeftWhereShown({5, 15, 25}, 1, 0), Sky::kNot) << "a third of it";
  EXPECT_EQ(LeftWhereShown({5, 15, 25, 35}, 1, 0), Sky::kMayBe) << "a quarter";
  const std::vector<int> rows = {2, 7, 12, 17, 22, 27, 32, 37, 42, 47};
  EXPECT_EQ(LeftWhereShown(rows, 4, 2), Sky::kNot);
  EXPECT_EQ(LeftWhereShown(rows, 5, 3), Sky::kMayBe) << "less than twice as often as infinitely far away";
}

// The sources' images end below the spots; then two rows of them lie within, which they show brighter.
TEST(RegionSky, WhatNoViewShowsIsOnItsPlane) {
  AboveARoof scene(100, 100);
  EXPECT_EQ(LeftAboveARoof(scene, {5, 15, 25}), Sky::kSeen);
  for (ViewImage& source : scene.input.sources) source.image = std::make_shared<const GrayImage>(160, 120, std::uint8_t{140});
  for (SceneView& source : scene.sources) source.camera.pinhole.cy -= 60;
  EXPECT_EQ(LeftAboveARoof(scene, {5, 15, 25}), Sky::kNot);
  for (SceneView& source : scene.sources) source.camera.pinhole.cy += 50;
  EXPECT_EQ(LeftAboveARoof(scene, {5, 15, 25}), Sky::kMayBe);
}

// In a plain image what was measured fills the lower quarter's left end, and clues its right one, but for one measured column. The
// sources show it brighter wherever they look, so that it may be the sky or not.
TEST(RegionPlanes, WhereItMayBeSkyCluesCarryNoLines) {
  AboveARoof scene(100, 100);
  for (ViewImage& source : scene.input.sources) source.image = std::make_shared<const GrayImage>(160, 120, std::uint8_t{140});
  const float w = 0.3f;
  PlaneMap planes(160, 120);
  for (int y = 90; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      if (x < 20 || x >= 140) planes(x, y) = {{0, 0, -1}, 1 / w};
    }
  }
  MeasurementMap measured = AllMeasured(std::move(planes));
  for (int y = 90; y < 120; ++y) std::fill(&measured.states(140, y), &measured.states(140, y) + 20, PixelState::kClue);
  for (int y = 110; y < 120; ++y) measured.states(150, y) = PixelState::kMeasured;
  const auto offered = [&](float sky, int x, int y) {
    Rules rules;
    rules.Set(Rule::kSky, sky);
    PlaneEvidence evidence;
    evidence.scene = {{w, 0, 0}};
    evidence.views.emplace(scene.input, std::vector<RelativeExposure>(2));
    evidence.states = std::as_const(measured.states).view();
    const GrayImage& image = *scene.input.reference.image;
    const Hypotheses hypotheses = RegionHypotheses(measured, rules, image, SharedRegions(image, rules), 1, evidence);
    return std::array{hypotheses.state().maps.inverse_depth[kHorizontal](x, y), hypotheses.state().maps.inverse_depth[kDescending](x, y)};
  };
  EXPECT_NEAR(offered(0, 80, 100)[0], w, 1e-4f) << "from measured pixels to clues";
  EXPECT_NEAR(offered(0, 80, 100)[1], w, 1e-4f) << "the region's plane";
  EXPECT_EQ(offered(1, 80, 100), (std::array{0.0f, 0.0f})) << "clues carry none";
  EXPECT_EQ(offered(1, 145, 100)[0], 0) << "nor does a clue offer its own depth";
  EXPECT_NEAR(offered(1, 80, 115)[0], w, 1e-4f) << "between measured pixels";
}

// A plain image that the sources show alike infinitely far away, as much as the reference, with anchors in its lower rows alone.
TEST(RegionPlanes, WhatIsMostlyMeasuredIsNoSky) {
  const AboveARoof scene(100, 100);
  const auto sky = [&](int first_row) {
    Array2D<float> anchors(160, 120);
    for (int y = first_row; y < 120; ++y) std::fill(&anchors(0, y), &anchors(0, y) + 160, 0.3f);
    PlaneEvidence evidence;
    evidence.scene = {{0.3, 0, 0}};
    evidence.views.emplace(scene.input, std::vector<RelativeExposure>(2));
    const GrayImage& image = *scene.input.reference.image;
    const RegionPlanes planes(SharedRegions(image), std::as_const(anchors).view(), 1, evidence);
    Sky at_80_10 = Sky::kNot;
    planes.ForFittedRuns(10, [&](int begin, int end, const FittedRegion& region) {
      if (begin <= 80 && 80 < end) at_80_10 = region.sky;
    });
    return at_80_10;
  };
  EXPECT_EQ(sky(60), Sky::kSeen) << "half of the rows";
  EXPECT_EQ(sky(59), Sky::kNot);
}

// What was measured fills the left fifth and, beside and before the house, all from column 90 on. Wall or sky, the even region between
// has no other anchors.
TEST(RegionPlanes, WhereViewsShowTheSkyNoLineCrossesIt) {
  const auto horizontal_at_50 = [](int num_dark) {
    const BesideAHouse scene(0, num_dark);
    const float w = 0.3f;
    PlaneMap planes(160, 120);
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 160; ++x) {
        if (x < 30 || x >= 90) planes(x, y) = {{0, 0, -1}, 1 / w};
      }
    }
    const MeasurementMap measured = AllMeasured(std::move(planes));
    PlaneEvidence evidence;
    evidence.scene = {{w, 0, 0}};
    evidence.views.emplace(scene.input, std::vector<RelativeExposure>(1));
    evidence.states = std::as_const(measured.states).view();
    Rules rules;
    const GrayImage& image = *scene.input.reference.image;
    const Hypotheses hypotheses = RegionHypotheses(measured, rules, image, SharedRegions(image, rules), 1, evidence);
    return hypotheses.state().maps.inverse_depth[kHorizontal](50, 60);
  };
  EXPECT_EQ(horizontal_at_50(0), 0);
  EXPECT_NEAR(horizontal_at_50(12), 0.3f, 1e-4f) << "the camera sees the house where a wall would be";
}

}  // namespace
}  // namespace phi
