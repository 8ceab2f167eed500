#include "phi/inference/shaded_surface.h"

#include <cmath>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "phi/inference/region_planes.h"
#include "tests/support/centered_view.h"
#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 480, kHeight = 100;
constexpr double kFocal = 480, kX = -0.1, kZ = 2.4, kRadius = 0.4;  // world units: a column along y, its axis at (kX, kZ)

// How bright the column is at an angle around it, from the camera's side: dark to bright, and not symmetric.
double Shade(double angle) { return 120 + 70 * std::sin(angle + 0.5) + 15 * std::sin(3 * angle); }

// Where a ray from `x` (y and z are 0) meets the column, or the wall behind it; the depth.
struct Met {
  double depth, brightness;
};
Met Meet(double x, double ray_x) {
  // (x + t r - kX)^2 + (t - kZ)^2 = R^2
  const double from = x - kX, a = ray_x * ray_x + 1, b = from * ray_x - kZ, c = from * from + kZ * kZ - kRadius * kRadius;
  const double root = b * b - a * c;
  if (root < 0) return {4, 30};
  const double t = (-b - std::sqrt(root)) / a;
  return {t, Shade(std::atan2(from + t * ray_x, kZ - t))};
}

// Photos from places along x, all alike in y; `gain` of the sources.
struct Column {
  std::vector<SceneView> views;
  InferenceInput input;
  std::vector<RelativeExposure> exposures;

  explicit Column(float gain = 1, bool is_shaded = true) {
    const double places[] = {0, -0.32, -0.16, 0.15, 0.3};
    for (int i = 0; i < 5; ++i) {
      views.push_back(test_support::CenteredView(static_cast<std::uint32_t>(i + 1), kWidth, kHeight, kFocal));
      views.back().camera.pose.translation = {-places[i], 0, 0};
    }
    for (int i = 0; i < 5; ++i) {
      auto image = std::make_shared<GrayImage>(kWidth, kHeight);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const Met met = Meet(places[i], (x + 0.5 - kWidth / 2.0) / kFocal);
          const double brightness = is_shaded || met.depth > 3 ? met.brightness : 120;
          (*image)(x, y) = static_cast<std::uint8_t>(std::lround(brightness / (i > 0 ? gain : 1)));
        }
      }
      if (i == 0) {
        input.reference = {&views[0], image};
        continue;
      }
      input.sources.push_back({&views[i], image});
      input.source_depths.push_back(nullptr);
      exposures.emplace_back(gain);
    }
  }

  static double InverseDepth(int x) { return 1 / Meet(0, (x + 0.5 - kWidth / 2.0) / kFocal).depth; }

  // Between the outlines, near columns 138 and 298.
  static std::vector<Spot> Spots() {
    std::vector<Spot> spots;
    for (int y = 10; y < kHeight - 10; y += 3) {
      for (int x = 160; x <= 272; x += 4) spots.push_back({x, y});
    }
    return spots;
  }

  std::optional<RegionPlane> Find(double start, const ShadeLimits& limits = {.min_change = 0.5},
                                  const std::vector<AnchorCell>& cells = {}) const {
    RegionPlane from;
    from.a = start;
    return SurfaceByShade(SpotViews(input, exposures), Spots(), cells, from, 5, limits);
  }
};

// As far as its outline: 12 % behind its front.
const double kStart = 1 / std::sqrt(kZ * kZ - kRadius * kRadius);

double LargestError(const RegionPlane& surface) {
  double largest = 0;
  for (const Spot& spot : Column::Spots()) {
    const double truth = Column::InverseDepth(spot.x);
    largest = std::max(largest, std::abs(surface.At(spot.x, spot.y) / truth - 1));
  }
  return largest;
}

TEST(ShadedSurface, OfAColumnFromItsOutlinesDepth) {
  const auto surface = Column().Find(kStart);
  ASSERT_TRUE(surface);
  EXPECT_LT(LargestError(*surface), 0.01);
}

TEST(ShadedSurface, ExposuresAreMadeAlike) {
  const auto surface = Column(1.25f).Find(kStart);
  ASSERT_TRUE(surface);
  EXPECT_LT(LargestError(*surface), 0.01);
}

TEST(ShadedSurface, WithoutShadeNothingIsTold) { EXPECT_FALSE(Column(1, false).Find(kStart)); }

TEST(ShadedSurface, AStartThatIsRightIsLeft) {
  const Column column;
  const auto surface = column.Find(kStart);
  ASSERT_TRUE(surface);
  ShadeLimits strict = {.min_change = 0.5};
  strict.max_left_share = 1e-3;
  EXPECT_FALSE(column.Find(kStart, strict));
}

TEST(ShadedSurface, MayNotMoveFartherThanDifferencesAskFor) {
  const Column column;
  EXPECT_TRUE(column.Find(kStart, {.min_change = 0.5, .max_moved = 2}));
  EXPECT_FALSE(column.Find(kStart, {.min_change = 0.5, .max_moved = 0.5}));
}

// So many on the column and as many more at the start's depth.
std::vector<AnchorCell> Cells(int num_on_column, int num_on_start) {
  std::vector<AnchorCell> cells;
  for (int i = 0; i < num_on_column + num_on_start; ++i) {
    const int x = 165 + 10 * i;
    const double w = i < num_on_column ? Column::InverseDepth(x) : kStart;
    cells.push_back({static_cast<float>(x), 50, w, 0.01 * w, 0, 0});
  }
  return cells;
}

TEST(ShadedSurface, CellsAreASecondWitness) {
  const ShadeLimits not_alone = {.min_change = 100};
  const Column column;
  EXPECT_FALSE(column.Find(kStart, not_alone));
  const auto surface = column.Find(kStart, not_alone, Cells(8, 2));
  ASSERT_TRUE(surface);
  EXPECT_LT(LargestError(*surface), 0.01);
  EXPECT_FALSE(column.Find(kStart, not_alone, Cells(6, 4)));  // by chance
  EXPECT_TRUE(column.Find(kStart, not_alone, Cells(2, 0)));
  EXPECT_FALSE(column.Find(kStart, not_alone, Cells(1, 0)));
  EXPECT_FALSE(column.Find(kStart, not_alone, Cells(2, 8)));
}

TEST(ShadedSurface, CellsAloneDoNotTell) {
  EXPECT_FALSE(Column(1, false).Find(kStart, {}, Cells(4, 0)));
  EXPECT_FALSE(Column().Find(kStart, {.max_left_share = 1e-3}, Cells(4, 0)));
}

// Of the four sources the last two see nothing where what they measured lies far behind the column.
TEST(ShadedSurface, TwoViewsDoNotTell) {
  Column column;
  const auto hide_from = [&](std::size_t source) {
    MeasuredDepths depths = AllMeasured(DepthMap(kWidth, kHeight));
    std::fill(depths.depths.begin(), depths.depths.end(), 10.0f);
    std::fill(depths.states.begin(), depths.states.end(), PixelState::kMeasured);
    column.input.source_depths[source] = std::make_shared<const MeasuredDepths>(std::move(depths));
  };
  hide_from(3);
  EXPECT_TRUE(column.Find(kStart));
  hide_from(2);
  EXPECT_FALSE(column.Find(kStart));
}

// The column's region, with anchors at its outlines alone, 12 % behind its front; `slope`: of their inverse depth to both sides
// from the middle, a pixel.
RegionPlanes PlanesOfColumn(const Column& column, const Rules& rules, double slope = 0) {
  constexpr int kMiddle = 218;
  GrayImage even(kWidth, kHeight, 30);
  Array2D<float> anchors(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 142; x <= 294; ++x) {
      even(x, y) = 120;
      if (x < 162 || x > 284) anchors(x, y) = static_cast<float>(kStart - slope * std::abs(x - kMiddle));
    }
  }
  PlaneEvidence evidence;
  evidence.views.emplace(column.input, column.exposures);
  evidence.scene = {{kStart - slope * kMiddle, slope, 0}, {kStart + slope * kMiddle, -slope, 0}};
  return RegionPlanes(SharedRegions(even), std::as_const(anchors).view(), 1, evidence, rules);
}

TEST(ShadedSurface, TakesThePlaceOfARegionsPlane) {
  const Column column;
  Rules rules;
  const auto at_front = [&] {
    const int x = 218, y = 50;
    return PlanesOfColumn(column, rules).At(x, y)[0].At(x, y) / Column::InverseDepth(x);
  };
  rules.Set(Rule::kShadedSurfaces, 0.25f);
  EXPECT_NEAR(at_front(), 1, 0.01);
  rules.Set(Rule::kShadedSurfaces, 100);
  EXPECT_LT(at_front(), 0.92);
  rules.Set(Rule::kShadedSurfaces, 0);
  EXPECT_LT(at_front(), 0.92);
}

TEST(ShadedSurface, IsNotAskedOfARegionWithTwoPlanes) {
  const Column column;
  Rules rules;
  rules.Set(Rule::kShadedSurfaces, 0.25f);
  rules.Set(Rule::kSky, 0);
  rules.Set(Rule::kSpotBrightness, 0);
  const RegionPlanes planes = PlanesOfColumn(column, rules, 1e-3);
  ASSERT_TRUE(planes.At(218, 50)[1].IsThere());
  EXPECT_EQ(planes.At(218, 50)[0].bend.xx, 0);
}

TEST(ShadedSurface, TouchingPlaneFollowsTheBend) {
  RegionPlane surface;
  surface.a = 0.4, surface.b = 1e-3, surface.c = -2e-3;
  surface.bend = {50, 40, 3e-5, -2e-5, 1e-5};
  const InverseDepthPlane plane = surface.Around(60, 70);
  EXPECT_NEAR(surface.InverseDepth(60, 70), 0.4 + 0.06 - 0.14 + 3e-5 * 100 - 2e-5 * 300 + 1e-5 * 900, 1e-12);
  const double step = 1e-3;
  EXPECT_NEAR(plane.slope_x, (surface.InverseDepth(60 + step, 70) - surface.InverseDepth(60 - step, 70)) / (2 * step), 1e-7);
  EXPECT_NEAR(plane.slope_y, (surface.InverseDepth(60, 70 + step) - surface.InverseDepth(60, 70 - step)) / (2 * step), 1e-7);
}

}  // namespace
}  // namespace phi
