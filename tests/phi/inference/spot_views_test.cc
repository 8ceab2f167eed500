#include "phi/inference/spot_views.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/centered_view.h"

namespace phi {
namespace {

// Pixel (75, 45) of the reference at inverse depth 0.33 is (300 * (-4.5 / 150 - 0.5 * 0.33) + 160, 300 * (-14.5 / 150 - 0.005 *
// 0.33) + 120) = (101.5, 90.5) of the source: its pixel (101, 90), which alone is darker.
struct DarkPixel {
  SceneView reference = test_support::CenteredView(1, 160, 120, 150), source = test_support::CenteredView(2, 320, 240, 300);
  GrayImage reference_image = GrayImage(160, 120, 120), source_image = GrayImage(320, 240, 120);
  MeasuredDepths depths = AllMeasured(DepthMap(320, 240));
  float gain = 1;

  DarkPixel() {
    source.camera.pose.translation = {-0.5, -0.005, 0};
    source_image(101, 90) = 60;
  }

  InferenceInput Input() const {
    InferenceInput input;
    input.reference = {&reference, std::make_shared<GrayImage>(reference_image)};
    input.sources = {{&source, std::make_shared<GrayImage>(source_image)}};
    input.source_depths = {std::make_shared<const MeasuredDepths>(depths)};
    return input;
  }
  double Unlike(double w) const {
    const InferenceInput input = Input();
    return SpotViews(input, std::vector<RelativeExposure>{RelativeExposure(gain)}).Unlike({75, 45}, w);
  }
  std::optional<ShadeOfSpot> Shade(float w) const {
    const InferenceInput input = Input();
    const SpotViews views(input, std::vector<RelativeExposure>{RelativeExposure(gain)});
    return views.ShadeIn(0, {75, 45}, *views.MeanHere({75, 45}), w);
  }
  // 2 grey levels a column, 3 a row; 100 in pixel (100, 90).
  void SlantShadeOfSource() {
    for (int y = 80; y < 100; ++y) {
      for (int x = 80; x < 120; ++x) source_image(x, y) = static_cast<std::uint8_t>(100 + 2 * (x - 100) + 3 * (y - 90));
    }
  }
};

TEST(SpotViews, AnotherBrightnessIsSeenWhereThePlanePutsTheSpot) {
  const DarkPixel scene;
  EXPECT_EQ(scene.Unlike(0.33), 1);
  // u = 151 - 150 w: a pixel beside, to either side.
  EXPECT_EQ(scene.Unlike(0.33 - 1 / 150.0), 0);
  EXPECT_EQ(scene.Unlike(0.33 + 1 / 150.0), 0);
}

TEST(SpotViews, ExposureIsNoDifference) {
  DarkPixel scene;
  scene.gain = 2;
  EXPECT_EQ(scene.Unlike(0.33), 0);
  EXPECT_EQ(scene.Unlike(0.3), 1);
}

TEST(SpotViews, SixGreyLevelsAreTheSame) {
  DarkPixel scene;
  scene.source_image(101, 90) = 114;
  EXPECT_EQ(scene.Unlike(0.33), 0);
  scene.source_image(101, 90) = 113;
  EXPECT_EQ(scene.Unlike(0.33), 1);
}

TEST(SpotViews, AViewThatMeasuredSomethingElseThereTellsNothing) {
  DarkPixel scene;
  scene.depths.depths(101, 90) = static_cast<float>(1 / 0.33);
  scene.depths.states(101, 90) = PixelState::kMeasured;
  EXPECT_EQ(scene.Unlike(0.33), 1);
  scene.depths.depths(101, 90) = static_cast<float>(0.97 / 0.33);
  EXPECT_EQ(scene.Unlike(0.33), 0) << "hidden";
  scene.depths.depths(101, 90) = static_cast<float>(1.03 / 0.33);
  EXPECT_EQ(scene.Unlike(0.33), 0) << "seen through";
}

TEST(SpotViews, WhatNoViewShowsIsNotUnlikeAndNoDepthIs) {
  const DarkPixel scene;
  EXPECT_EQ(scene.Unlike(3), 0) << "beside the source image";
  EXPECT_EQ(scene.Unlike(-0.1), 1);
}

// The spot's direction is pixel (151, 91) of the source, from everywhere.
TEST(SpotViews, InfinitelyFarIsComparedWithThePlaceOfThePoint) {
  DarkPixel scene;
  const auto look = [&](std::uint8_t far, std::uint8_t near) {
    scene.source_image(151, 91) = far;
    scene.source_image(101, 90) = near;
    const InferenceInput input = scene.Input();
    const FarSpot seen = SpotViews(input, std::vector<RelativeExposure>(1)).LookFar({75, 45}, 0.33);
    EXPECT_EQ(seen.is_seen, !IsMeasured(scene.depths.states(151, 91)));
    return std::tuple(seen.unlike, seen.is_shown, seen.is_seen_on_plane, seen.is_shown_on_plane);
  };
  EXPECT_EQ(look(120, 120), std::tuple(0.0, true, true, true));
  EXPECT_EQ(look(120, 60), std::tuple(0.0, true, true, false)) << "alike there alone";
  EXPECT_EQ(look(60, 120), std::tuple(1.0, false, true, true)) << "alike at the point alone";
  EXPECT_EQ(look(60, 60), std::tuple(0.0, false, true, false)) << "in neither place";
  scene.depths.depths(101, 90) = static_cast<float>(0.97 / 0.33);
  scene.depths.states(101, 90) = PixelState::kMeasured;
  EXPECT_EQ(look(60, 120), std::tuple(1.0, false, false, false)) << "the point is hidden";
  scene.depths.depths(151, 91) = 3;
  scene.depths.states(151, 91) = PixelState::kMeasured;
  EXPECT_EQ(look(60, 120), std::tuple(0.0, false, false, false)) << "something was measured in the direction";
}

// At (101.5, 90.505) it is 102.015. With w the place moves by (-150, -1.5) pixels, and the shade there by -304.5.
TEST(SpotViews, ShadeAndItsSlopeWithDepth) {
  DarkPixel scene;
  scene.SlantShadeOfSource();
  const auto shade = scene.Shade(0.33f);
  ASSERT_TRUE(shade);
  EXPECT_NEAR(shade->change, 120 - 102.015, 1e-3);
  EXPECT_NEAR(shade->slope, 304.5, 1e-2);
  scene.gain = 1.5f;
  EXPECT_NEAR(scene.Shade(0.33f)->change, 120 - 1.5 * 102.015, 1e-3);
  EXPECT_NEAR(scene.Shade(0.33f)->slope, 1.5 * 304.5, 2e-2);
}

TEST(SpotViews, ShadeOfWhatAViewMeasuredElsewhereIsNotAsked) {
  DarkPixel scene;
  scene.SlantShadeOfSource();
  const auto measured = [&](double depth) {
    scene.depths.depths(101, 90) = static_cast<float>(depth / 0.33);
    scene.depths.states(101, 90) = PixelState::kMeasured;
    return scene.Shade(0.33f).has_value();
  };
  EXPECT_TRUE(measured(0.97));
  EXPECT_TRUE(measured(1.03));
  EXPECT_FALSE(measured(0.93));
  EXPECT_FALSE(measured(1.07));
}

TEST(SpotViews, ShadeThatMayBeCutOffAtWhiteTellsNothing) {
  DarkPixel scene;
  scene.SlantShadeOfSource();
  for (std::uint8_t& grey : scene.source_image) grey = static_cast<std::uint8_t>(std::min(255, grey + 140));
  EXPECT_TRUE(scene.Shade(0.33f)) << "242";
  for (std::uint8_t& grey : scene.source_image) grey = static_cast<std::uint8_t>(std::min(255, grey + 5));
  EXPECT_FALSE(scene.Shade(0.33f)) << "247";
}

// Both images are plain, and the cameras have one orientation, so that a direction has one pixel in both.
struct PlaneBeforeTwoViews {
  SceneView reference = test_support::CenteredView(1, 160, 120, 150), source = test_support::CenteredView(2, 160, 120, 150);
  GrayImage reference_image = GrayImage(160, 120, 120), source_image = GrayImage(160, 120, 120);
  MeasuredDepths depths = AllMeasured(DepthMap(160, 120));
  PlaneMap measured = PlaneMap(160, 120);  // by the reference
  float gain = 1;

  // `center`: of the source camera, before the reference camera's axes.
  explicit PlaneBeforeTwoViews(const Eigen::Vector3d& center) { source.camera.pose.translation = -center; }

  Foretold Count(const ImagePlane& plane, std::vector<Spot> spots = {{75, 45}}) const {
    InferenceInput input;
    input.reference = {&reference, std::make_shared<GrayImage>(reference_image)};
    input.sources = {{&source, std::make_shared<GrayImage>(source_image)}};
    input.source_depths = {std::make_shared<const MeasuredDepths>(depths)};
    input.measured = std::make_shared<const MeasurementMap>(AllMeasured(measured));
    return SpotViews(input, std::vector<RelativeExposure>{RelativeExposure(gain)}).CountForetold(spots, plane);
  }
  void Darken(int x, int y, float brightness = 60) {
    for (int dy = -2; dy <= 2; ++dy) std::fill_n(&reference_image(x - 2, y + dy), 5, brightness);
  }
  // The reference's pixel whose surroundings the plane foretells for the source's view in the direction of (75, 45).
  std::pair<int, int> ForetoldPixel(const ImagePlane& plane) {
    for (int y = 2; y < 118; ++y) {
      for (int x = 2; x < 158; ++x) {
        if (std::abs(x - 75) <= 2 && std::abs(y - 45) <= 2) continue;
        Darken(x, y);
        const std::size_t num_unlike = Count(plane).num_unlike;
        Darken(x, y, 120);
        if (num_unlike == 1) return {x, y};
      }
    }
    return {-1, -1};
  }
};

// From half a metre to the right, the ray in the direction of (75.5, 45.5) meets a plane at inverse depth w at u = 75.5 + 150 * 0.5 w.
TEST(SpotViews, FromBesideAnotherPartOfThePlaneLiesInTheSpotsDirection) {
  PlaneBeforeTwoViews views({0.5, 0, 0});
  EXPECT_EQ(views.ForetoldPixel({0.3269, 0, 0}), std::pair(100, 45)) << "100.02";
  EXPECT_EQ(views.ForetoldPixel({0.3265, 0, 0}), std::pair(99, 45)) << "99.99";
  // 0.3957 at the spot, and 0.004 more a pixel: 75.5 + 75 * 0.3957 / (1 - 75 * 0.004).
  EXPECT_EQ(views.ForetoldPixel({0.0957, 0.004, 0}), std::pair(117, 45)) << "117.90";
}

// The camera's centre (0.2, -0.1, 1) is e = (110, 45, 1) in the image. At image point (u, v) the plane's inverse depth is q . (u, v, 1),
// q = (0.0004, -0.0002, 0.1999). The point e + t (75.5, 45.5, 1) lies on it where q . e + t q . (75.5, 45.5, 1) = 1: 0.2349 + 0.221 t = 1.
// It is (371.38, 202.52, 4.462).
TEST(SpotViews, FromFurtherOnASlantedPlaneIsMetWhereTheRayMeetsIt) {
  PlaneBeforeTwoViews views({0.2, -0.1, 1});
  EXPECT_EQ(views.ForetoldPixel({0.2, 0.0004, -0.0002}), std::pair(83, 45)) << "(83.23, 45.39)";
}

TEST(SpotViews, WhatAPlaneForetellsIsSeenWhereTheSourceShowsSomethingUnlikeTheSpot) {
  PlaneBeforeTwoViews views({0.5, 0, 0});
  const ImagePlane plane{0.33, 0, 0};
  views.source_image(75, 45) = 60;
  EXPECT_EQ(views.Count(plane).num_unlike, 0u) << "nothing unlike is foretold";
  views.Darken(100, 45);
  EXPECT_EQ(views.Count(plane).num_unlike, 1u);
  EXPECT_EQ(views.Count(plane).num_seen, 1u);
  views.gain = 2;
  EXPECT_EQ(views.Count(plane).num_seen, 0u) << "as bright as the spot";
  views.gain = 1;
  EXPECT_EQ(views.Count(plane, {{75, 45}, {75, 45}, {75, 80}}).num_seen, 2u);
  views.depths.states(75, 45) = PixelState::kMeasured;
  views.depths.depths(75, 45) = 2;
  EXPECT_EQ(views.Count(plane).num_unlike, 0u) << "what stands before it says nothing of it";
}

TEST(SpotViews, NothingIsForetoldByThinThingsShadingAndWhatStandsBefore) {
  PlaneBeforeTwoViews views({0.5, 0, 0});
  const ImagePlane plane{0.33, 0, 0};
  views.Darken(100, 45, 120 - 12);
  EXPECT_EQ(views.Count(plane).num_unlike, 0u) << "what is six grey levels from both is like both";
  views.Darken(100, 45, 120 - 13);
  EXPECT_EQ(views.Count(plane).num_unlike, 1u);
  for (int y = 0; y < 120; ++y) views.reference_image(102, y) = 120;
  EXPECT_EQ(views.Count(plane).num_unlike, 0u) << "thin";
  views.Darken(100, 45);
  views.measured(100, 45) = {{0, 0, -1}, static_cast<float>(0.99 / 0.33)};
  EXPECT_EQ(views.Count(plane).num_unlike, 1u) << "measured on the plane";
  views.measured(100, 45).depth = static_cast<float>(0.97 / 0.33);
  EXPECT_EQ(views.Count(plane).num_unlike, 0u) << "the plane may go on behind it";
  views.measured(100, 45).depth = static_cast<float>(1.5 / 0.33);
  EXPECT_EQ(views.Count(plane).num_unlike, 1u) << "there the plane has ended";
}

TEST(SpotViews, BesideTheImageAndBehindThePlaneNothingIsForetold) {
  PlaneBeforeTwoViews beside({0.5, 0, 0});
  std::fill(beside.reference_image.begin(), beside.reference_image.end(), 60);
  beside.reference_image(75, 45) = 120;
  EXPECT_EQ(beside.Count({1.09, 0, 0}).num_unlike, 1u) << "u = 157.25";
  EXPECT_EQ(beside.Count({1.11, 0, 0}).num_unlike, 0u) << "u = 158.75";
  PlaneBeforeTwoViews behind({0.5, 0, 4});
  behind.reference_image = beside.reference_image;
  EXPECT_EQ(behind.Count({0.24, 0, 0}).num_unlike, 1u);
  EXPECT_EQ(behind.Count({0.26, 0, 0}).num_unlike, 0u) << "the source camera has passed it";
}

// The plane at 2, (x, y) at 3: the pixel's centre (100.5, 70.5) lies at X = 3 * 20.5 / 150 = 0.41, Y = 3 * 10.5 / 150 = 0.21. Mirrored it
// is at depth 1: pixel 80 + 150 * 0.41 = 141.5, 60 + 150 * 0.21 = 91.5.
TEST(SpotViews, AMirroredPointIsSoughtWhereItLies) {
  const SceneView reference = test_support::CenteredView(1, 160, 120, 150);
  const auto count = [&](int x, int y, float depth, PixelState state) {
    PlaneMap planes(160, 120);
    planes(x, y) = {{0, 0, -1}, depth};
    MeasurementMap map = AllMeasured(std::move(planes));
    map.states(x, y) = state;
    InferenceInput input;
    input.reference = {&reference, std::make_shared<const GrayImage>(160, 120, 120)};
    input.measured = std::make_shared<const MeasurementMap>(std::move(map));
    const std::vector<AnchorCell> behind = {{100, 70, 1 / 3.0, 0.001, 0, 0}};
    const SpotViews::Mirrored mirrored = SpotViews(input, {}).CountMirrored(behind, {0.5, 0, 0});
    return std::tuple(mirrored.num_measured, mirrored.num_seen_past, mirrored.num_by_chance);
  };
  EXPECT_EQ(count(141, 91, 1, PixelState::kMeasured), std::tuple(1u, 0u, 0.0));
  for (const auto& [x, y] : {std::pair(140, 91), {142, 91}, {141, 90}, {141, 92}}) {
    EXPECT_EQ(count(x, y, 1, PixelState::kMeasured), std::tuple(0u, 0u, 0.0)) << x << " " << y;
  }
  EXPECT_EQ(count(141, 91, 1, PixelState::kInferredAlone), std::tuple(0u, 0u, 0.0));
  EXPECT_EQ(count(141, 91, 1.3f, PixelState::kMeasured), std::tuple(0u, 1u, 0.0));
  EXPECT_EQ(count(141, 91, 0.8f, PixelState::kMeasured), std::tuple(0u, 0u, 0.0));
  EXPECT_EQ(count(141, 91, 1.06f, PixelState::kMeasured), std::tuple(0u, 1u, 0.5));
  EXPECT_EQ(count(141, 91, 1 / 1.06f, PixelState::kMeasured), std::tuple(0u, 0u, 0.5));
}

// The plane Z - X = 2, on which 1 / Z = 0.5 - (u - 80) / 300, swaps X + 2 and Z. The centre of (50, 70) at Z = 2.5 lies at X = -0.49167,
// Y = 0.175, and mirrored at X = 0.5, Z = 1.50833: pixel 80 + 150 * 0.5 / Z = 129.7, 60 + 150 * 0.175 / Z = 77.4. The source, twice as
// large and 0.3 to the right, shows it at 160 + 300 * 0.2 / Z = 199.8, 154.8.
TEST(SpotViews, ASlantedPlaneMirrorsToTheSide) {
  const ImagePlane plane{0.5 + 79.5 / 300, -1 / 300.0, 0};
  DarkPixel scene;
  scene.source.camera.pose.translation = {-0.3, 0, 0};
  const auto count = [&](int x, int y, float depth) {
    scene.depths = AllMeasured(DepthMap(320, 240));
    scene.depths.depths(x, y) = depth;
    scene.depths.states(x, y) = PixelState::kMeasured;
    const InferenceInput input = scene.Input();
    const std::vector<AnchorCell> behind = {{50, 70, 1 / 2.5, 0.001, 0, 0}};
    return SpotViews(input, std::vector<RelativeExposure>(1)).CountMirrored(behind, plane).num_measured;
  };
  EXPECT_EQ(count(199, 154, 1.50833f), 1u);
  EXPECT_EQ(count(199, 154, 1.47f), 0u) << "2.6 %";
  EXPECT_EQ(count(198, 154, 1.50833f), 0u);
  EXPECT_EQ(count(199, 155, 1.50833f), 0u);
}

}  // namespace
}  // namespace phi
