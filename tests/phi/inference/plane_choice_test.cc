#include "phi/inference/plane_choice.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "phi/inference/region_planes.h"
#include "phi/inference/view_choice.h"
#include "tests/phi/inference/above_a_roof.h"
#include "tests/support/centered_view.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

using Planes = PlanesOfRegion;

constexpr PlaneChoiceLimits kLimits{3, 0.05, 0.02, 5, 8};
const ImagePlane kWall{0.3, 0.001, 0}, kShelf{0.4, 0, 0.001};

std::vector<AnchorCell> Both(std::vector<AnchorCell> a, const std::vector<AnchorCell>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// That reaches everywhere.
RegionPlane Own(const ImagePlane& plane) { return {plane, 0, 0, 1e-9, 0, 1e-9}; }

void ExpectIs(const RegionPlane& chosen, const ImagePlane& plane) {
  EXPECT_EQ(std::tuple(chosen.a, chosen.b, chosen.c), std::tuple(plane.a, plane.b, plane.c));
}

TEST(PlaneChoice, TheScenesIsTakenWhereMoreCellsLieOnIt) {
  const auto cells = Both(CellsOn(kWall, 0, 100, 0, 40), CellsOn(kShelf, 0, 100, 100, 120));
  ExpectIs(ChoosePlanes({cells}, Planes{Own(kShelf)}, std::array{kWall}, kLimits).planes[0], kWall);
}

TEST(PlaneChoice, TheOwnIsKeptWhereMoreCellsLieOnIt) {
  const auto cells = Both(CellsOn(kShelf, 0, 100, 0, 40), CellsOn(kWall, 0, 100, 100, 120));
  const RegionPlane chosen = ChoosePlanes({cells}, Planes{Own(kShelf)}, std::array{kWall}, kLimits).planes[0];
  ExpectIs(chosen, kShelf);
  EXPECT_EQ(chosen.xx, 1e-9) << "with its own reach";
}

TEST(PlaneChoice, OfTwoThatAllCellsLieOnTheNearerIsTaken) {
  const auto cells = CellsOn(kWall, 0, 100, 0, 100, 1.0005);
  const ImagePlane off{0.3006, 0.001, 0};
  ExpectIs(ChoosePlanes({cells}, Planes{}, std::array{off, kWall}, kLimits).planes[0], kWall);
  ExpectIs(ChoosePlanes({cells}, Planes{}, std::array{kWall, off}, kLimits).planes[0], kWall);
}

// Eight cells of a shelf hide nothing of the wall that six show behind it: the shelf is not the region's surface.
TEST(PlaneChoice, WhatLiesBehindAPlaneCountsAgainstItWhatLiesBeforeDoesNot) {
  const auto cells = Both(CellsOn(kShelf, 0, 80, 50, 60), CellsOn(kWall, 0, 60, 0, 10));
  ASSERT_EQ(cells.size(), 14u);
  ExpectIs(ChoosePlanes({cells}, Planes{Own(kShelf)}, std::array{kWall}, kLimits).planes[0], kWall);
  const auto more = Both(CellsOn(kShelf, 0, 130, 50, 60), CellsOn(kWall, 0, 60, 0, 10));
  ExpectIs(ChoosePlanes({more}, Planes{Own(kShelf)}, std::array{kWall}, kLimits).planes[0], kShelf);
}

// Three cells at a crease, four times a rim's, against ten of frames that hang a hundredth before the wall.
TEST(PlaneChoice, CellsCountByTheirWeights) {
  const ImagePlane frames{0.303, 0.00101, 0};
  const auto rims = CellsOn(frames, 0, 100, 50, 60);
  auto creases = CellsOn(kWall, 0, 30, 0, 10);
  ExpectIs(ChoosePlanes({Both(rims, creases)}, Planes{}, std::array{frames, kWall}, kLimits).planes[0], frames);
  for (AnchorCell& cell : creases) cell.weight = 4;
  ExpectIs(ChoosePlanes({Both(rims, creases)}, Planes{}, std::array{frames, kWall}, kLimits).planes[0], kWall);
}

// Through the middle of a 160 x 120 image with focal length 150, turned about the vertical; inverse depth 0.3 at (x, 60).
ImagePlane TurnedAt(double x, double degrees) {
  const double slope = 0.3 * std::tan(degrees * std::numbers::pi / 180) / (150 + (x - 79.5) * std::tan(degrees * std::numbers::pi / 180));
  return {0.3 - slope * x, slope, 0};
}

// A wall straight ahead, and what hangs half to two hundredths before it: on a plane that leans.
TEST(PlaneChoice, WhatStandsAlongADirectionOfTheSceneIsLikelier) {
  const SceneDirections directions(Eigen::Matrix3d::Identity(), {160, 120, 150, 150, 80, 60});
  const ImagePlane ahead{0.3, 0, 0};
  PlaneChoiceLimits limits = kLimits;
  limits.aligned_weight = 0.3;
  // Two rows of what leans: a floor goes through one row too.
  const auto chosen = [&](const ImagePlane& leaning, int num_leaning, int num_ahead, const SceneDirections* of_scene) {
    const auto cells = Both(CellsOn(leaning, 0, 5 * num_leaning, 0, 20), CellsOn(ahead, 0, 10 * num_ahead, 100, 110));
    return ChoosePlanes({cells, {}, nullptr, {}, of_scene}, Planes{}, std::array{leaning, ahead}, limits).planes[0];
  };
  const ImagePlane leaning = TurnedAt(-25, 2);
  ASSERT_NEAR(directions.AngleTo(leaning), 2 * std::numbers::pi / 180, 1e-6);
  ExpectIs(chosen(leaning, 6, 5, nullptr), leaning);
  ExpectIs(chosen(leaning, 6, 5, &directions), ahead);  // 5/11 + 0.3 against 6/11
  ExpectIs(chosen(leaning, 10, 3, &directions), leaning);
  // What leans by half a degree has three quarters of the weight: 22/40 + 0.225 against 18/40 + 0.3.
  const ImagePlane nearly = TurnedAt(-60, 0.5);
  ExpectIs(chosen(nearly, 22, 18, &directions), nearly);
}

// The program offers them itself.
TEST(PlaneChoice, PlanesAlongADirectionAreOffered) {
  const SceneDirections directions(Eigen::Matrix3d::Identity(), {160, 120, 150, 150, 80, 60});
  const auto cells = CellsOn({0.3, 0, 0}, 0, 50, 90, 110);
  EXPECT_FALSE(ChoosePlanes({cells}, Planes{}, {}, kLimits).planes[0].IsThere());
  const RegionPlane offered = ChoosePlanes({cells, {}, nullptr, {}, &directions}, Planes{}, {}, kLimits).planes[0];
  ASSERT_TRUE(offered.IsThere());
  EXPECT_NEAR(offered.InverseDepth(100, 10), 0.3, 1e-12);
}

TEST(PlaneChoice, FewCellsAreNotEnough) {
  EXPECT_FALSE(ChoosePlanes({CellsOn(kWall, 0, 20, 0, 10)}, Planes{}, std::array{kWall}, kLimits).planes[0].IsThere());
  EXPECT_TRUE(ChoosePlanes({CellsOn(kWall, 0, 30, 0, 10)}, Planes{}, std::array{kWall}, kLimits).planes[0].IsThere());
  const ImagePlane lamp{1, 0, 0};
  const auto three_of_103 = Both(CellsOn(kWall, 0, 30, 0, 10), CellsOn(lamp, 0, 100, 100, 200));
  EXPECT_FALSE(ChoosePlanes({three_of_103}, Planes{}, std::array{kWall}, kLimits).planes[0].IsThere());
}

TEST(PlaneChoice, APlaneOfTheSceneReachesFiveDeviationsFromItsCells) {
  const RegionPlane chosen = ChoosePlanes({CellsOn(kWall, 0, 110, 0, 110)}, Planes{}, std::array{kWall}, kLimits).planes[0];
  // Places 0 to 100 in steps of 10: mean 50, variance 1000, and 64 for a cell's own size: 5 * sqrt(1064) = 163.1.
  EXPECT_GT(chosen.At(50 + 163, 50), 0);
  EXPECT_EQ(chosen.At(50 + 164, 50), 0);
  EXPECT_FLOAT_EQ(chosen.At(60, 70), static_cast<float>(kWall.InverseDepth(60, 70)));
}

TEST(PlaneChoice, TwoWallsThatMeetAreBothTaken) {
  // They meet at x = 100.
  const ImagePlane left{0.3, 0.001, 0}, right{0.5, -0.001, 0};
  const auto cells = Both(CellsOn(left, 0, 100, 0, 50), CellsOn(right, 110, 180, 0, 50));
  const Planes chosen = ChoosePlanes({cells}, Planes{}, std::array{right, left}, kLimits).planes;
  ExpectIs(chosen[0], left);
  ExpectIs(chosen[1], right);
}

// The source view is the reference view once more, and all of its image one region.
struct SeenAgain {
  SceneView view = test_support::CenteredView(1, 160, 120, 150);
  std::vector<SourceRegions> sources;
  std::vector<Spot> spots;

  // `told`: its planes. `columns`: of its spots that are the region's.
  explicit SeenAgain(const Planes& told = {Own(kWall)}, int columns = 27, const std::vector<AnchorCell>& cells = CellsOn(kWall, 0, 160, 0, 60)) {
    const SpotGrid grid(160, 120);
    ViewRegions regions;
    regions.label = Array2D<std::int32_t>(grid.columns, grid.rows, -1);
    for (int row = 0; row < grid.rows; ++row) std::fill_n(&regions.label(0, row), columns, 0);
    SpotBox whole;
    whole.AddCell(0, 0, grid.step);
    whole.AddCell(grid.columns - 1, grid.rows - 1, grid.step);
    regions.regions.push_back({whole, cells, {}, told});
    sources.emplace_back(std::make_shared<const ViewRegions>(std::move(regions)), view.camera, view.camera);
    for (int x = 3; x < 150; x += 6) spots.push_back({x, 90});
  }
};

// Five cells at a shelf's foot: without other views the region is the shelf's.
TEST(PlaneChoice, APlaneOfAnotherViewsRegionIsTakenWhereBothTogetherLikeItBetter) {
  const SeenAgain scene;
  const std::vector<AnchorCell> cells = CellsOn(kShelf, 0, 50, 100, 110);
  PlaneChoiceLimits limits = kLimits;
  const auto choose = [&] { return ChoosePlanes({cells, scene.spots, nullptr, scene.sources}, Planes{Own(kShelf)}, {}, limits).planes[0]; };
  ExpectIs(choose(), kShelf);
  limits.source_weight = 1;
  // The shelf: 5 / 10 of its own, -1 of the other view, whose wall lies behind it. The wall: 0 and 1.
  const RegionPlane chosen = choose();
  EXPECT_NEAR(chosen.a, kWall.a, 1e-6);
  EXPECT_NEAR(chosen.b, kWall.b, 1e-9);
  EXPECT_TRUE(chosen.IsThere()) << "it reaches around the other view's cells";
}

// The region's cells are the shelf's. Each view shows 8 of its 25 spots, as part of the wall: what two views say together, not
// on average, outweighs the cells. The shelf's 1 - 0.32 against the wall's 0.32, then 1 - 0.64 against 0.64.
TEST(PlaneChoice, EachViewIsAWitness) {
  SeenAgain scene(Planes{Own(kWall)}, 8);
  const std::vector<AnchorCell> cells = CellsOn(kShelf, 0, 100, 100, 120);
  PlaneChoiceLimits limits = kLimits;
  limits.source_weight = 1;
  const auto choose = [&] { return ChoosePlanes({cells, scene.spots, nullptr, scene.sources}, Planes{Own(kShelf)}, {}, limits).planes[0]; };
  EXPECT_NEAR(choose().a, kShelf.a, 1e-6);
  scene.sources.push_back(scene.sources[0]);
  EXPECT_NEAR(choose().a, kWall.a, 1e-6);
}

// Once the shelf's cells are explained, nothing of the region's own lies on the wall, which the other view shows.
TEST(PlaneChoice, OtherViewsAloneCarryNoSecondPlane) {
  const SeenAgain scene(Planes{Own(kWall)}, 8);
  PlaneChoiceLimits limits = kLimits;
  limits.source_weight = 1;
  const auto choose = [&](const std::vector<AnchorCell>& cells) {
    return ChoosePlanes({cells, scene.spots, nullptr, scene.sources}, Planes{Own(kShelf)}, {}, limits).planes;
  };
  const std::vector<AnchorCell> shelf = CellsOn(kShelf, 0, 100, 100, 140);
  EXPECT_NEAR(choose(shelf)[0].a, kShelf.a, 1e-6);
  EXPECT_FALSE(choose(shelf)[1].IsThere());
  const Planes with_own = choose(Both(shelf, CellsOn(kWall, 0, 40, 0, 10)));
  EXPECT_NEAR(with_own[0].a, kShelf.a, 1e-6);
  EXPECT_NEAR(with_own[1].a, kWall.a, 1e-6) << "with cells of its own it is";
}

// Both views' cells lie on the wall; the region's own plane goes past them by 0.2 %, within their tolerance.
TEST(PlaneChoice, TheChosenPlaneIsFittedToTheCellsOfAllViews) {
  const SeenAgain scene(Planes{});
  const ImagePlane past{1.002 * kWall.a, 1.002 * kWall.b, 1.002 * kWall.c};
  PlaneChoiceLimits limits = kLimits;
  limits.source_weight = 1;
  const std::vector<AnchorCell> cells = CellsOn(kWall, 0, 50, 100, 110);
  ExpectIs(ChoosePlanes({cells, scene.spots}, Planes{Own(past)}, {}, limits).planes[0], past);
  const RegionPlane chosen = ChoosePlanes({cells, scene.spots, nullptr, scene.sources}, Planes{Own(past)}, {}, limits).planes[0];
  for (const auto& [x, y] : {std::pair(0, 0), {159, 0}, {0, 119}, {159, 119}})
    EXPECT_NEAR(chosen.InverseDepth(x, y), kWall.InverseDepth(x, y), 1e-6);
}

// The region's own cells lie on frames half a hundredth before a wall straight ahead. Two other views measured the wall, and both
// offer a plane through its middle that leans by two degrees.
TEST(PlaneChoice, PlanesAlongADirectionGoThroughTheCellsOfAllViews) {
  const SceneDirections directions(Eigen::Matrix3d::Identity(), {160, 120, 150, 150, 80, 60});
  const ImagePlane wall{0.3, 0, 0};
  SeenAgain scene(Planes{Own(TurnedAt(79.5, 2))}, 27, CellsOn(wall, 0, 160, 0, 60));
  scene.sources.push_back(scene.sources[0]);
  PlaneChoiceLimits limits = kLimits;
  limits.source_weight = 1;
  limits.aligned_weight = 0.3;
  const std::vector<AnchorCell> cells = CellsOn({0.3015, 0, 0}, 0, 50, 100, 120);
  const RegionPlane chosen = ChoosePlanes({cells, scene.spots, nullptr, scene.sources, &directions}, Planes{}, {}, limits).planes[0];
  for (const auto& [x, y] : {std::pair(0, 0), {159, 0}, {0, 119}, {159, 119}}) EXPECT_NEAR(chosen.InverseDepth(x, y), 0.3, 1e-6);
}

// What the one region of a source view that is the reference again chose; that view measured nothing.
std::vector<SourceRegions> ChosenBySource(const Planes& chosen) {
  const SceneView view = test_support::CenteredView(1, 160, 120, 150);
  const SpotGrid grid(160, 120);
  ViewRegions told;
  told.label = Array2D<std::int32_t>(grid.columns, grid.rows, 0);
  told.regions.resize(1);
  told.regions[0].image_region = 0;
  told.regions[0].box.AddCell(0, 0, grid.step);
  told.regions[0].box.AddCell(grid.columns - 1, grid.rows - 1, grid.step);
  auto choice = std::make_shared<ViewChoice>();
  choice->fitted.index = {0};
  choice->fitted.regions.resize(1);
  choice->fitted.regions[0].planes = chosen;
  return {{std::make_shared<const ViewRegions>(std::move(told)), view.camera, view.camera, std::move(choice)}};
}

PlaneChoiceLimits AgreementLimits(double weight) {
  PlaneChoiceLimits limits = kLimits;
  limits.source_weight = 1;
  limits.agreement_weight = weight;
  return limits;
}

std::vector<Spot> ManySpots() {
  std::vector<Spot> spots;
  for (int x = 3; x < 150; x += 6) spots.push_back({x, 90});
  return spots;
}

// 22 cells on frames a hundredth before a wall that 18 show. Where the other view chose the wall, all agrees with it and three quarters
// with the frames: 18/40 + w against 22/40 + 3/4 w.
TEST(PlaneChoice, ChosenAgainAPlaneCountsByWhatOtherViewsChose) {
  const ImagePlane wall{0.3, 0, 0}, frames{0.303, 0, 0};
  const auto cells = Both(CellsOn(wall, 0, 60, 0, 30), CellsOn(frames, 0, 110, 50, 70));
  const std::vector<Spot> spots = ManySpots();
  const auto choose = [&](double weight, const ImagePlane& by_source, const Planes& own) {
    const PlaneChoiceLimits limits = AgreementLimits(weight);
    const std::vector<SourceRegions> sources = ChosenBySource({Own(by_source)});
    const RegionEvidence region = {cells, spots, nullptr, sources};
    const ChosenPlanes before = ChoosePlanes(region, own, {}, limits);
    EXPECT_NEAR(before.planes[0].a, frames.a, 1e-6) << "what others chose is not asked yet";
    return ChoosePlanesAgain(region, before, limits);
  };
  const auto expect_wall = [&](const std::optional<ChosenPlanes>& chosen) {
    ASSERT_TRUE(chosen);
    EXPECT_NEAR(chosen->planes[0].InverseDepth(80, 90), 0.3, 1e-6);
    EXPECT_TRUE(chosen->planes[0].IsThere());
  };
  expect_wall(choose(0.42, wall, {Own(frames), Own(wall)}));
  EXPECT_FALSE(choose(0.38, wall, {Own(frames), Own(wall)})) << "it keeps what it took";
  expect_wall(choose(0.42, wall, {Own(frames)}));  // the other view's plane is offered
  EXPECT_FALSE(choose(0.42, frames, {Own(frames), Own(wall)}));
}

// A wall by two planes 0.1 % apart, and two others that meet it: eight cells of the region lie on the one, seven on the other. The other
// view chose the wall's second plane and the other.
TEST(PlaneChoice, ChosenAgainASecondPlaneCountsByCellsAlone) {
  const ImagePlane wall{0.2, 0, 0}, again{0.2002, 0, 0}, eight{0.216, -0.0002, 0}, seven{0.11, 0, 0.001};
  const auto meeting = Both(CellsOn(eight, 0, 80, 0, 10), Both(CellsOn(seven, 110, 130, 92, 122), CellsOn(seven, 130, 140, 92, 102)));
  const auto cells = Both(CellsOn(wall, 0, 100, 50, 70), meeting);
  const std::vector<Spot> spots = ManySpots();
  const PlaneChoiceLimits limits = AgreementLimits(100);
  const std::vector<SourceRegions> sources = ChosenBySource({Own(again), Own(seven)});
  const RegionEvidence region = {cells, spots, nullptr, sources};
  const ChosenPlanes before = ChoosePlanes(region, {}, std::array{wall, eight, seven}, limits);
  EXPECT_NEAR(before.planes[0].a, wall.a, 1e-6);
  const std::optional<ChosenPlanes> chosen = ChoosePlanesAgain(region, before, limits);
  ASSERT_TRUE(chosen);
  EXPECT_NEAR(chosen->planes[0].InverseDepth(80, 90), 0.2, 1e-3);
  EXPECT_NEAR(chosen->planes[1].a, eight.a, 1e-6);
}

TEST(PlaneChoice, WhatIsKnownToBeNoSkyIsNotAsked) {
  const AboveARoof scene(100, 100);
  const SpotViews views(scene.input, std::array<RelativeExposure, 2>());
  PlaneChoiceLimits limits = kLimits;
  limits.sky.min_unlike = 0.6;
  const RegionEvidence known = {scene.roof, scene.spots, &views, {}, nullptr, false};
  EXPECT_TRUE(ChoosePlanes(known, Planes{}, std::array{kRoof}, limits).planes[0].IsThere());
}

TEST(PlaneChoice, TheSkyIsToldFromWhatHasNoPlane) {
  const AboveARoof scene(100, 100);
  const SpotViews views(scene.input, std::array<RelativeExposure, 2>());
  PlaneChoiceLimits limits = kLimits;
  const auto sky = [&](const std::vector<AnchorCell>& cells, double min_unlike) {
    limits.sky.min_unlike = min_unlike;
    return ChoosePlanes({cells, scene.spots, &views}, Planes{}, std::array{kRoof}, limits).sky;
  };
  EXPECT_EQ(sky(scene.roof, 0.6), Sky::kSeen);
  EXPECT_EQ(sky(scene.roof, 0.4 - 1e-9), Sky::kNot) << "its plane is taken";
  EXPECT_EQ(sky({}, 0.6), Sky::kNot) << "no plane was offered";
  // A plane before the roof's, with fewer cells, all over the image.
  const ImagePlane before{0.6, 0, 0};
  const auto cells = Both(scene.roof, CellsOn(before, 0, 160, 0, 30));
  const RegionEvidence known = {Both(cells, CellsOn(before, 0, 160, 90, 120)), scene.spots, &views};
  const ChosenPlanes chosen = ChoosePlanes(known, Planes{}, std::array{kRoof, before}, limits);
  ExpectIs(chosen.planes[0], before);
  EXPECT_EQ(chosen.sky, Sky::kNot) << "another plane was taken";
}

TEST(PlaneChoice, AViewThatShowsLittleOfTheRegionHasNoSay) {
  SeenAgain scene;
  for (Spot& spot : scene.spots) spot.x += 200;  // beside the image
  PlaneChoiceLimits limits = kLimits;
  limits.source_weight = 1;
  const std::vector<AnchorCell> cells = CellsOn(kShelf, 0, 50, 100, 110);
  ExpectIs(ChoosePlanes({cells, scene.spots, nullptr, scene.sources}, Planes{Own(kShelf)}, {}, limits).planes[0], kShelf);
}

// A wall at 1 / 0.33, brighter from column 80 on, which the source camera half a metre to the right sees from 80 - 150 * 0.5 * 0.33 =
// 55.25 on. Of the bright part five cells lie on it, and twelve on a plane at 1 / 0.66, which puts its spots up to column 104 where
// the source is dark: 3 of 13. By cells alone (12 - 5) / 17 are more than 5 / 17.
TEST(RegionPlanes, APlaneThatOtherViewsShowWithAnotherBrightnessLoses) {
  const ImagePlane wall{0.33, 0, 0}, before{0.66, 0, 0};
  const SceneView reference = test_support::CenteredView(1, 160, 120, 150);
  SceneView source = test_support::CenteredView(2, 160, 120, 150);
  source.camera.pose.translation = {-0.5, 0, 0};
  const auto halves = [](int from) {
    auto image = std::make_shared<GrayImage>(160, 120, std::uint8_t{60});
    for (int y = 0; y < 120; ++y) std::fill(&(*image)(from, y), &(*image)(0, y) + 160, std::uint8_t{120});
    return image;
  };
  Array2D<float> anchors(160, 120);
  const auto add = [&](int x, int y, const ImagePlane& plane) { anchors(x, y) = anchors(x + 1, y) = static_cast<float>(plane.a); };
  for (const auto& [x, y] : {std::pair(86, 8), {150, 8}, {86, 110}, {150, 110}, {118, 62}}) add(x, y, wall);
  for (const int x : {92, 110, 128, 146}) {
    for (const int y : {20, 50, 92}) add(x, y, before);
  }
  InferenceInput input;
  input.reference = {&reference, halves(80)};
  input.sources = {{&source, halves(55)}};
  input.source_depths = {std::make_shared<const MeasuredDepths>(AllMeasured(DepthMap(160, 120)))};
  const auto plane = [&](float factor) {
    PlaneEvidence evidence;
    evidence.scene = {before, wall};
    evidence.views.emplace(input, std::vector<RelativeExposure>(1));
    Rules rules;
    rules.Set(Rule::kSpotBrightness, factor);
    rules.Set(Rule::kSky, 0);  // which asks about the same views' brightness
    return RegionPlanes(SharedRegions(*input.reference.image, rules), std::as_const(anchors).view(), 1, evidence, rules).At(120, 40)[0];
  };
  ExpectIs(plane(1), wall);
  ExpectIs(plane(0), before);
}

// A plain image whose only anchors are 25 pairs of pixels: too few for a plane of their own.
TEST(RegionPlanes, ARegionWithFewAnchorsTakesTheScenesPlane) {
  Array2D<float> anchors(160, 120);
  for (int i = 0; i < 50; ++i) {
    const int x = 30 * (i / 2 % 5) + 7 + i % 2, y = 24 * (i / 10) + 8;
    anchors(x, y) = static_cast<float>(kWall.InverseDepth(x, y));
  }
  const auto planes = [&](std::vector<ImagePlane> scene) {
    return RegionPlanes(SharedRegions(GrayImage(160, 120, 120)), std::as_const(anchors).view(), 3, {.pooled = {}, .scene = std::move(scene), .views = {}, .sources = {}, .precision = {}});
  };
  EXPECT_FALSE(planes({}).At(20, 20)[0].IsThere());
  EXPECT_TRUE(planes({kShelf, kWall}).At(20, 20)[0].IsThere());
  ExpectIs(planes({kShelf, kWall}).At(20, 20)[0], kWall);
}

}  // namespace
}  // namespace phi
