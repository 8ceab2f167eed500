#include "phi/geometry/depth_agreement.h"

#include <gtest/gtest.h>

#include "phi/geometry/camera.h"
#include "phi/geometry/device_camera.h"
#include "phi/matching/matching_window.h"

namespace phi {
namespace {

TEST(DepthAgreement, ToleranceIsAShareOfTheOwnDepth) {
  EXPECT_TRUE(DepthsAgree(100, 100.9f, kSameDepth));
  EXPECT_FALSE(DepthsAgree(100, 101.1f, kSameDepth));
  EXPECT_TRUE(DepthsAgree(100, 99.1f, kSameDepth));
  EXPECT_FALSE(DepthsAgree(100, 98.9f, kSameDepth));
  EXPECT_TRUE(DepthsAgree(2.5f * 100, 2.5f * 100.9f, kSameDepth)) << "one factor changes nothing";
}

TEST(DepthAgreement, AGapIsTwoPercentOfTheFarDepth) {
  EXPECT_TRUE(LiesBefore(97.9f, 100));
  EXPECT_FALSE(LiesBefore(98.1f, 100));
  EXPECT_FALSE(LiesBefore(100, 97));
}

// f = 100, 200 pixels; a point 2 m away, 0.5 m to the right and 0.25 m down.
TEST(Projection, IsTheSameInBothPrecisions) {
  const Pinhole pinhole{80, 60, 100, 200, 40, 30};
  const ImagePoint single = MakeRayModel(pinhole).Project({0.5f, 0.25f, 2});
  EXPECT_EQ(single.u, 65);
  EXPECT_EQ(single.v, 55);
  EXPECT_EQ(pinhole.Project({0.5, 0.25, 2}), Eigen::Vector2d(65, 55));
}

// 7 / 2 = 3.5 rounds to 4 samples a side, which reach 8 pixels: the step is the option's.
TEST(MatchingWindow, SamplesAreAStepApart) {
  StereoOptions options;
  EXPECT_EQ(MakeMatchingWindow(options).samples_per_side, 5);
  EXPECT_EQ(MakeMatchingWindow(options).step, 1.4f);
  options.window_step = 2;
  EXPECT_EQ(MakeMatchingWindow(options).samples_per_side, 4);
  EXPECT_EQ(MakeMatchingWindow(options).step, 2);
}

}  // namespace
}  // namespace phi
