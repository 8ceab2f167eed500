#include "phi/inference/spot_views.h"

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

  double Unlike(double w) const {
    InferenceInput input;
    input.reference = {&reference, std::make_shared<GrayImage>(reference_image)};
    input.sources = {{&source, std::make_shared<GrayImage>(source_image)}};
    input.source_depths = {std::make_shared<const MeasuredDepths>(depths)};
    return SpotViews(input, std::vector<float>{gain}).Unlike({75, 45}, w);
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

}  // namespace
}  // namespace phi
