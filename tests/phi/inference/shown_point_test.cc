#include "phi/inference/shown_point.h"

#include <cmath>

#include <gtest/gtest.h>

#include "phi/geometry/camera.h"

namespace phi {
namespace {

constexpr int kWidth = 120, kHeight = 40;

TEST(ShownPoint, LiesInAPixelOfTheImage) {
  ShownPoint shown;
  ASSERT_TRUE(FindInImage({25, 5, 2}, kWidth, kHeight, &shown));
  EXPECT_EQ(shown.u, 12.5f);
  EXPECT_EQ(shown.v, 2.5f);
  EXPECT_EQ(shown.z, 2);
  EXPECT_EQ(shown.x(), 12);
  EXPECT_EQ(shown.y(), 2);
}

TEST(ShownPoint, BehindTheCameraOrBesideTheImageThereIsNone) {
  ShownPoint shown;
  EXPECT_FALSE(FindInImage({-25, -5, -2}, kWidth, kHeight, &shown));
  EXPECT_FALSE(FindInImage({0, 0, 0}, kWidth, kHeight, &shown));
  EXPECT_TRUE(FindInImage({0, 0, 1}, kWidth, kHeight, &shown)) << "its first corner";
  EXPECT_FALSE(FindInImage({-0.1f, 0, 1}, kWidth, kHeight, &shown));
  EXPECT_FALSE(FindInImage({0, -0.1f, 1}, kWidth, kHeight, &shown));
  EXPECT_TRUE(FindInImage({std::nextafter(120.0f, 0.0f), std::nextafter(40.0f, 0.0f), 1}, kWidth, kHeight, &shown));
  EXPECT_FALSE(FindInImage({120, 39, 1}, kWidth, kHeight, &shown));
  EXPECT_FALSE(FindInImage({119, 40, 1}, kWidth, kHeight, &shown));
  EXPECT_FALSE(FindInImage({std::nanf(""), 0, 1}, kWidth, kHeight, &shown));
}

// The source stands 0.5 m to the right of the reference, f = 100: a point 2 m away is 25 pixels further left there.
TEST(ShownPoint, OfAPixelAtAnInverseDepth) {
  Camera reference;
  reference.pinhole = {kWidth, kHeight, 100, 100, 60, 20};
  Camera source = reference;
  source.pose.translation = {-0.5, 0, 0};
  const RelativeView view = MakeRelativeView(reference, source);
  ShownPoint shown;
  ASSERT_TRUE(FindInImage(ProjectInverseDepth(view, 80.5f, 20.5f, 0.5f), kWidth, kHeight, &shown));
  EXPECT_NEAR(shown.u, 55.5f, 1e-5f);
  EXPECT_NEAR(shown.v, 20.5f, 1e-5f);
  EXPECT_NEAR(shown.z, 1, 1e-6f) << "2 m times 0.5";
  ASSERT_TRUE(FindInImage(ProjectInverseDepth(view, 80.5f, 20.5f, 0), kWidth, kHeight, &shown)) << "infinitely far away";
  EXPECT_NEAR(shown.u, 80.5f, 1e-5f);
}

}  // namespace
}  // namespace phi
