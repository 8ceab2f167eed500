#include "phi/inference/source_regions.h"

#include <algorithm>
#include <memory>
#include <utility>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "phi/inference/view_choice.h"
#include "tests/support/centered_view.h"

namespace phi {
namespace {

using test_support::CenteredView;

// The source camera stands half a metre to the right of the reference's and looks along the same axis.
struct TwoViews {
  SceneView reference = CenteredView(1, 160, 120, 150), source = CenteredView(2, 320, 240, 300);

  TwoViews() { source.camera.pose.translation = {-0.5, 0, 0}; }

  SourceRegions Regions(ViewRegions regions = {}, std::shared_ptr<const ViewChoice> choice = nullptr) const {
    return {std::make_shared<const ViewRegions>(std::move(regions)), source.camera, reference.camera, std::move(choice)};
  }
};

void ExpectNear(const ImagePlane& plane, const ImagePlane& expected) {
  EXPECT_NEAR(plane.a, expected.a, 1e-6);
  EXPECT_NEAR(plane.b, expected.b, 1e-8);
  EXPECT_NEAR(plane.c, expected.c, 1e-8);
}

// z - x = 3 in the reference's frame: 1 / z = (1 - (u - 80) / 150) / 3 with u = x + 0.5. In the source's, where x is half a metre
// less, z - x = 3.5: 1 / z = (1 - (u - 160) / 300) / 3.5.
TEST(SourceRegions, APlaneInTheOtherCamera) {
  const ImagePlane in_reference{(1 + 79.5 / 150) / 3, -1 / 450.0, 0}, in_source{(1 + 159.5 / 300) / 3.5, -1 / 1050.0, 0};
  const SourceRegions regions = TwoViews().Regions();
  ImagePlane plane;
  ASSERT_TRUE(regions.ToSource(in_reference, &plane));
  ExpectNear(plane, in_source);
  ASSERT_TRUE(regions.ToReference(in_source, &plane));
  ExpectNear(plane, in_reference);
}

// z - 6 x = 3: the source camera's centre, x = 0.5, lies on its edge: 0 - 3 = -3 and not 3 away, behind it.
TEST(SourceRegions, APlaneThatPassesTheOtherCameraIsNone) {
  ImagePlane plane;
  EXPECT_FALSE(TwoViews().Regions().ToSource({(1 + 6 * 79.5 / 150) / -3, 6 / 450.0, 0}, &plane));
}

// Pixel (100, 90) at 3 m is (75.25, 45.25) in the reference image: array indices 74.75 and 44.75.
TEST(SourceRegions, ACellInTheReference) {
  TwoViews views;
  AnchorCell here;
  ASSERT_TRUE(views.Regions().ToReference(AnchorCell{100, 90, 1 / 3.0, 0.001, 0, 0}, &here));
  EXPECT_NEAR(here.x, 74.75, 1e-4);
  EXPECT_NEAR(here.y, 44.75, 1e-4);
  EXPECT_NEAR(here.w, 1 / 3.0, 1e-9);
  // A metre further on, what lies 2 m before the source lies 3 m before the reference.
  views.source.camera.pose.translation = {0, 0, -1};
  ASSERT_TRUE(views.Regions().ToReference(AnchorCell{100, 90, 0.5, 0.003, 0, 0}, &here));
  EXPECT_NEAR(here.w, 1 / 3.0, 1e-9);
  EXPECT_NEAR(here.tolerance, 0.002, 1e-9) << "relative, it stays";
}

TEST(SourceRegions, CellsOfRegionsThatContinueEachOtherAreGatheredOnce) {
  ViewRegions told;
  const auto cell_at = [](float x) { return AnchorCell{x, 90, 1 / 3.0, 0.001, 0, 0}; };
  told.regions = {{{}, {cell_at(100), cell_at(110)}, {1}, {}}, {{}, {cell_at(200)}, {0}, {}}, {{}, {cell_at(300)}, {}, {}}};
  const SourceRegions regions = TwoViews().Regions(told);
  const auto weights = [&](const std::vector<std::size_t>& of) {
    std::vector<float> weights;
    regions.ForCells(of, [&](const AnchorCell& cell, bool continues) { weights.push_back(continues ? 0.5f * cell.weight : cell.weight); });
    return weights;
  };
  EXPECT_EQ(weights({0}), (std::vector<float>{1, 1, 0.5f}));
  EXPECT_EQ(weights({1}), (std::vector<float>{1, 0.5f, 0.5f}));
  EXPECT_EQ(weights({0, 1}), (std::vector<float>{1, 1, 1}));
  EXPECT_EQ(weights({2}), (std::vector<float>{1}));
}

// Pixel x of the reference at 3 m is u = 2 * x - 49 of the source, and places of its grid are 6 pixels: half a pixel more and
// 75 would be in the next one.
TEST(SourceRegions, TheRegionThatASpotFallsIn) {
  const SpotGrid grid(320, 240);
  ViewRegions told;
  told.label = Array2D<std::int32_t>(grid.columns, grid.rows, -1);
  told.label(101 / 6, 91 / 6) = 4;
  const SourceRegions regions = TwoViews().Regions(told);
  const ImagePlane wall{1 / 3.0, 0, 0};
  const std::vector<Spot> spots = {{75, 45}, {76, 45}, {73, 45}, {72, 45}};
  EXPECT_EQ(regions.RegionsUnder(wall, spots), (std::vector<std::int32_t>{4, -1, 4, -1}));
  EXPECT_EQ(regions.RegionsUnder({1 / 2.0, 0, 0}, spots)[0], -1) << "of another plane";
  // The source also half a metre lower, and the wall where both shifts are 50.97 pixels: (73, 70) is (96.03, 90.03), and with half a
  // pixel less either way it would be in another place.
  TwoViews lower;
  lower.source.camera.pose.translation = {-0.5, -0.5, 0};
  EXPECT_EQ(lower.Regions(told).RegionsUnder({0.3398, 0, 0}, std::vector<Spot>{{73, 70}})[0], 4);
}

TEST(SourceRegions, ARegionThatFewSpotsFallInDoesNotCount) {
  const SpotGrid grid(320, 240);
  ViewRegions told;
  told.label = Array2D<std::int32_t>(grid.columns, grid.rows, 0);
  told.label(101 / 6, 91 / 6) = 1;
  const SourceRegions regions = TwoViews().Regions(told);
  const ImagePlane wall{1 / 3.0, 0, 0};
  std::vector<Spot> spots(9, Spot{100, 45});
  spots.push_back({75, 45});
  const auto overlaps = regions.OverlapsUnder(wall, spots);
  ASSERT_EQ(overlaps.size(), 1u);
  EXPECT_EQ(overlaps[0].region, 0);
  EXPECT_DOUBLE_EQ(overlaps[0].share, 0.9);
  spots.push_back({75, 45});
  spots.push_back({75, 45});
  EXPECT_EQ(regions.OverlapsUnder(wall, spots).size(), 2u);
}

// As TheRegionThatASpotFallsIn: of the spots (75, 45), (73, 45), (76, 45) and (72, 45) the first two fall in the region. It chose a
// plane that is a wall at 3 m at the middle of its place, (99, 93), and nowhere else.
TEST(SourceRegions, AgreesAsFarAsTheRegionsThatSpotsFallInChoseThePlane) {
  const SpotGrid grid(320, 240);
  ViewRegions told;
  told.label = Array2D<std::int32_t>(grid.columns, grid.rows, -1);
  told.label(101 / 6, 91 / 6) = 1;
  told.regions.resize(2);
  told.regions[1].image_region = 3;
  const auto agreement = [&](double off, double ellipse, const PlanesOfRegion& first = {}) {
    auto choice = std::make_shared<ViewChoice>();
    choice->fitted.index = {-1, -1, -1, 1};
    choice->fitted.regions.resize(2);
    const double w = (1 + off) / 3, b = 0.001, c = 0.002;
    choice->fitted.regions[1].planes = {first[0], RegionPlane{{w - 99 * b - 93 * c, b, c}, 99, 93, ellipse, 0, ellipse}};
    return TwoViews().Regions(told, std::move(choice)).Agreement({1 / 3.0, 0, 0}, std::vector<Spot>{{75, 45}, {73, 45}, {76, 45}, {72, 45}}, 0.02);
  };
  constexpr double kEverywhere = 1e-9;
  EXPECT_NEAR(agreement(0, kEverywhere), 0.5, 1e-6);
  EXPECT_NEAR(agreement(0.01, kEverywhere), 0.5 * 0.75, 1e-6);
  EXPECT_NEAR(agreement(-0.01, kEverywhere), 0.5 * 0.75, 1e-6);
  EXPECT_EQ(agreement(0.03, kEverywhere), 0) << "another plane is no reason against it";
  EXPECT_NEAR(agreement(0.03, kEverywhere, {RegionPlane{{1 / 3.0, 0, 0}, 0, 0, kEverywhere, 0, kEverywhere}}), 0.5, 1e-6) << "either of two";
  EXPECT_EQ(agreement(0, -1), 0) << "it chose none";
  EXPECT_EQ(TwoViews().Regions(told).Agreement({1 / 3.0, 0, 0}, std::vector<Spot>{{75, 45}}, 0.02), 0) << "what it chose is not known";
}

// Boxes only spare the count: whatever the planes, the same regions overlap.
TEST(SourceRegions, OverlapsAsTheCountOfAllSpotsSays) {
  TwoViews views;
  views.source.camera.pose.rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
  const SpotGrid grid(320, 240);
  ViewRegions told;
  told.label = Array2D<std::int32_t>(grid.columns, grid.rows, -1);
  told.regions.resize(48);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const int region = row * 6 / grid.rows * 8 + column * 8 / grid.columns;
      told.label(column, row) = region;
      told.regions[static_cast<std::size_t>(region)].box.AddCell(column, row, grid.step);
    }
  }
  const SourceRegions regions = views.Regions(told);
  int num_overlaps = 0, num_planes = 0;
  for (int i = 0; i < 400; ++i) {
    const auto number = [i](int k) { return 2.0 * ((i * 7919 + k * 104729) % 1009) / 1009 - 1; };
    const ImagePlane there{0.3 + 0.25 * number(0), 0.002 * number(1), 0.002 * number(2)};
    const int x = 80 + static_cast<int>(60 * number(3)), y = 60 + static_cast<int>(40 * number(4));
    std::vector<Spot> spots;
    SpotBox box;
    for (int k = 0; k < 64; ++k) {
      spots.push_back({x + k % 8, y + k / 8});
      box.Add(static_cast<float>(spots.back().x), static_cast<float>(spots.back().y));
    }
    ImagePlane here;
    if (!regions.ToReference(there, &here)) continue;
    ++num_planes;
    const auto counted = regions.OverlapsUnder(here, spots);
    for (std::size_t r = 0; r < 48; ++r) {
      const bool expected = std::any_of(counted.begin(), counted.end(),
                                        [r](const auto& overlap) { return overlap.region == static_cast<std::int32_t>(r); });
      EXPECT_EQ(regions.Overlaps(r, there, here, spots, box), expected) << i << ' ' << r;
      num_overlaps += expected;
    }
  }
  EXPECT_GT(num_planes, 300);
  EXPECT_GT(num_overlaps, 100);
}

}  // namespace
}  // namespace phi
