// A mirror 2 before the camera, and a thing at 1 between them, which is seen at 3 in the mirror.
#include "phi/inference/mirror.h"

#include <array>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "phi/inference/hypotheses.h"
#include "phi/inference/plane_choice.h"
#include "phi/inference/region_pixels.h"
#include "phi/inference/region_planes.h"
#include "tests/support/centered_view.h"
#include "tests/support/region_hypotheses.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr float kSeen = 1 / 3.0f;  // inverse depth, in the mirror
const ImagePlane kMirror{0.5, 0, 0}, kBehind{kSeen, 0, 0};

AnchorCell Cell(int x, int y, double w) { return {static_cast<float>(x), static_cast<float>(y), w, 0.003 * w, x / 10, y / 10}; }

// Each column from x0 on and each row from y0 on, 10 pixels apart.
std::vector<AnchorCell> Cells(int x0, int x1, int y0, int y1, double w) {
  std::vector<AnchorCell> cells;
  for (int y = y0; y < y1; y += 10) {
    for (int x = x0; x < x1; x += 10) cells.push_back(Cell(x, y, w));
  }
  return cells;
}

// 24 cells of the frame around 20 of what is seen in the mirror. Mirrored, all of these lie in the images.
std::vector<AnchorCell> FramedCells() {
  std::vector<AnchorCell> cells = Cells(60, 110, 40, 80, kSeen);
  for (const int y : {30, 100}) {
    for (const AnchorCell& cell : Cells(50, 120, y, y + 1, 0.5)) cells.push_back(cell);
  }
  for (const int x : {50, 110}) {
    for (const AnchorCell& cell : Cells(x, x + 1, 40, 90, 0.5)) cells.push_back(cell);
  }
  return cells;
}

struct BeforeAMirror {
  SceneView reference = test_support::CenteredView(1, kWidth, kHeight, 150);
  std::vector<SceneView> views;
  InferenceInput input;
  std::vector<Spot> spots;

  // `depths`: what each source measured all over.
  explicit BeforeAMirror(const std::vector<float>& depths) : views(depths.size(), test_support::CenteredView(2, kWidth, kHeight, 150)) {
    const auto plain = std::make_shared<const GrayImage>(kWidth, kHeight, 120);
    input.reference = {&reference, plain};
    for (std::size_t j = 0; j < depths.size(); ++j) {
      input.sources.push_back({&views[j], plain});
      input.source_depths.push_back(std::make_shared<const MeasuredDepths>(AllMeasured(DepthMap(kWidth, kHeight, depths[j]))));
    }
    for (int y = 35; y < 100; y += 6) {
      for (int x = 55; x < 110; x += 6) spots.push_back({x, y});
    }
  }

  SpotViews Views() const { return {input, std::vector<RelativeExposure>(views.size())}; }
  double Share(const std::vector<AnchorCell>& cells, double full_share = 0.5) const {
    PlaneSides sides;
    for (const AnchorCell& cell : cells) sides.Add(kMirror, cell, 0.02);
    return ReflectedShare(std::move(sides), spots, kMirror, full_share, Views());
  }
  ChosenPlanes Choose(double full_reflected) const {
    PlaneChoiceLimits limits{3, 0.05, 0.02, 5, 8};
    limits.full_reflected = full_reflected;
    const SpotViews seen = Views();
    return ChoosePlanes({FramedCells(), spots, &seen}, {}, std::array{kMirror, kBehind}, limits);
  }
};

TEST(Mirror, WhatIsSeenInItIsItsReflection) {
  EXPECT_EQ(BeforeAMirror({1}).Share(FramedCells()), 1);
  EXPECT_EQ(BeforeAMirror({1.015f}).Share(FramedCells()), 1) << "within 2 %";
  EXPECT_EQ(BeforeAMirror({2.5f}).Share(FramedCells()), 0) << "a window, and a view that looks past where the thing would stand";
  EXPECT_EQ(BeforeAMirror({0.5f}).Share(FramedCells()), 0) << "hidden there";
  EXPECT_EQ(BeforeAMirror({2.5f, 1}).Share(FramedCells()), 1) << "one view that measured it is enough";
}

// Between leaves something is measured at any depth.
TEST(Mirror, WhatIsMeasuredByChanceIsNone) {
  EXPECT_EQ(BeforeAMirror({1, 1.06f, 1 / 1.06f}).Share(FramedCells()), 0);
  EXPECT_NEAR(BeforeAMirror({1, 1.06f}).Share(FramedCells()), 1, 1e-12) << "half of them, which is enough";
  EXPECT_NEAR(BeforeAMirror({1, 1.06f}).Share(FramedCells(), 1), 0.5, 1e-12);
}

// Of 40 cells behind, 20 lie where nothing is mirrored.
TEST(Mirror, TheShareIsOfCellsThatViewsTellOf) {
  std::vector<AnchorCell> cells = FramedCells();
  for (const AnchorCell& cell : Cells(60, 110, 40, 80, 1 / 2.4)) cells.push_back(cell);
  EXPECT_NEAR(BeforeAMirror({1.9f, 1}).Share(cells, 1), 0.5, 1e-12) << "mirrored at 1.6, which a view looks past";
  EXPECT_NEAR(BeforeAMirror({1}).Share(cells, 1), 1, 1e-12) << "hidden by the thing itself";
}

// Behind a plane through the fronts of frames lies the wall, and mirrored at the plane it lies on what hangs farther out.
TEST(Mirror, WhatLiesALittleBehindIsNoReflection) {
  const auto share = [](double w) {
    const auto mirrored = static_cast<float>(2 * 2 - 1 / w);
    std::vector<AnchorCell> cells = FramedCells();
    for (AnchorCell& cell : cells) {
      if (cell.w == kSeen) cell.w = w;
    }
    return BeforeAMirror({mirrored}).Share(cells);
  };
  EXPECT_EQ(share(0.5 * 0.985), 0) << "not behind";
  EXPECT_EQ(share(0.5 * 0.97), 0);
  EXPECT_EQ(share(0.5 * 0.91), 0);
  EXPECT_EQ(share(0.5 * 0.89), 1);
}

// A carpet begins at the door that it is seen in.
TEST(Mirror, WhatLiesALittleBehindGoesWithWhatLiesClearlyBehind) {
  const auto share = [](int num_rows) {  // of five cells a little behind the plane, beside 20 clearly behind it
    std::vector<AnchorCell> cells = FramedCells();
    for (const AnchorCell& cell : Cells(60, 110, 40, 40 + 10 * num_rows, 0.5 * 0.95)) cells.push_back(cell);
    return BeforeAMirror({1}).Share(cells);
  };
  EXPECT_EQ(share(4), 1);
  EXPECT_NEAR(share(6), 0.8, 1e-12);
  EXPECT_NEAR(share(12), 0.5, 1e-12);
}

TEST(Mirror, ItsFrameIsAllAround) {
  const BeforeAMirror scene({1});
  std::vector<AnchorCell> without_foot;
  for (const AnchorCell& cell : FramedCells()) {
    if (cell.w == kSeen || cell.y < 70) without_foot.push_back(cell);
  }
  EXPECT_EQ(scene.Share(without_foot), 0);
}

TEST(Mirror, FewCellsTellNothing) {
  const BeforeAMirror scene({1});
  const auto with = [&](int count) {
    std::vector<AnchorCell> cells;
    for (const AnchorCell& cell : FramedCells()) {
      if (cell.w != kSeen || --count >= 0) cells.push_back(cell);
    }
    return scene.Share(cells);
  };
  EXPECT_EQ(with(15), 0);
  EXPECT_EQ(with(16), 1);
}

// 24 cells on the frame less 20 behind it, against 20 on what is seen there.
TEST(Mirror, ItsFrameCarriesTheRegionsPlane) {
  const ChosenPlanes window = BeforeAMirror({2.5f}).Choose(0.4), mirror = BeforeAMirror({1}).Choose(0.4);
  EXPECT_EQ(window.planes[0].a, kBehind.a);
  EXPECT_FALSE(window.is_mirror);
  EXPECT_EQ(mirror.planes[0].a, kMirror.a);
  EXPECT_TRUE(mirror.is_mirror);
  EXPECT_FALSE(mirror.planes[1].IsThere()) << "what it shows is no second plane";
  EXPECT_EQ(BeforeAMirror({1}).Choose(0).planes[0].a, kBehind.a) << "no plane is a mirror";
}

// A plain image, measured along its frame and, within, where something is seen in it.
struct Measured {
  BeforeAMirror scene{{1}};
  MeasurementMap map;

  Measured() {
    scene.spots.clear();
    PlaneMap planes(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool is_frame = x < 8 || y < 8 || x >= kWidth - 8 || y >= kHeight - 8;
        const bool is_seen = x >= 60 && x < 105 && y >= 40 && y < 85;
        if (is_frame || is_seen) planes(x, y) = {{0, 0, -1}, is_frame ? 2.0f : 3.0f};
      }
    }
    map = AllMeasured(std::move(planes));
  }

  PlaneEvidence Evidence() const {
    PlaneEvidence evidence;
    evidence.scene = {kMirror, kBehind};
    evidence.views.emplace(scene.input, std::vector<RelativeExposure>(1));
    evidence.states = map.states.view();
    return evidence;
  }
  static Rules With(float factor) {
    Rules rules;
    rules.Set(Rule::kMirrors, factor);
    return rules;
  }
  const GrayImage& image() const { return *scene.input.reference.image; }
};

TEST(Mirror, NoLineRestsOnWhatItShows) {
  const Measured measured;
  const auto vertical_at = [&](float factor, int x, int y) {
    const Rules rules = Measured::With(factor);
    return RegionHypotheses(measured.map, rules, measured.image(), SharedRegions(measured.image(), rules), 1, measured.Evidence())
        .state().maps.inverse_depth[kVertical](x, y);
  };
  EXPECT_NEAR(vertical_at(1, 80, 30), 0.5, 1e-6);
  EXPECT_EQ(vertical_at(0, 80, 30), 0) << "between the frame and what lies behind";
}

TEST(Mirror, WhatItShowsTakesItsPlane) {
  Measured measured;
  const auto depth_at = [&](float factor) {
    const Rules rules = Measured::With(factor);
    Array2D<float> anchors(kWidth, kHeight);
    for (std::size_t i = 0; i < measured.map.size(); ++i) {
      const float depth = measured.map.planes.data()[i].depth;
      anchors.data()[i] = depth > 0 ? 1 / depth : 0;
    }
    const RegionPlanes planes(SharedRegions(measured.image(), rules), std::as_const(anchors).view(), 1, measured.Evidence(), rules);
    MeasurementMap map = measured.map;
    FinishRegionPixels(planes, measured.scene.input, rules, &map);
    return map.planes(80, 60).depth;
  };
  EXPECT_NEAR(depth_at(1), 2, 1e-5);
  EXPECT_NEAR(depth_at(0), 3, 1e-5);
}

}  // namespace
}  // namespace phi
