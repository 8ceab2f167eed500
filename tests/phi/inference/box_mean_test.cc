#include "phi/inference/box_mean.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

// 3 + 2 x + 5 y at array indices, which its mean over any square is at the middle.
GrayImage Ramp() {
  GrayImage image(20, 16);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 20; ++x) image(x, y) = static_cast<std::uint8_t>(3 + 2 * x + 5 * y);
  }
  return image;
}

TEST(BoxMean, OfARampIsTheRamp) {
  const GrayImage image = Ramp();
  for (const auto& [u, v] : {std::pair{8.5f, 7.5f}, {8.75f, 7.5f}, {9.1f, 6.2f}}) {
    const auto mean = MeanAround(image, u, v);
    ASSERT_TRUE(mean);
    EXPECT_NEAR(mean->value, 3 + 2 * (u - 0.5f) + 5 * (v - 0.5f), 1e-4);
    EXPECT_NEAR(mean->du, 2, 1e-5);
    EXPECT_NEAR(mean->dv, 5, 1e-5);
  }
}

// One bright pixel leaves the box on the left and at the top while the box moves right and down.
TEST(BoxMean, SlopesAreThoseOfTheMean) {
  GrayImage image(20, 16, 0);
  image(6, 5) = 250;
  const auto mean = MeanAround(image, 8.8f, 7.7f);  // columns 6.3 to 11.3, of which 6 counts 0.7; rows 5.2 to 10.2
  ASSERT_TRUE(mean);
  EXPECT_NEAR(mean->value, 0.7f * 0.8f * 10, 1e-4);
  EXPECT_NEAR(mean->du, -0.8f * 10, 1e-4);
  EXPECT_NEAR(mean->dv, -0.7f * 10, 1e-4);
}

TEST(BoxMean, AllPixelsMustBeInTheImage) {
  const GrayImage image = Ramp();
  EXPECT_TRUE(MeanAround(image, 2.5f, 2.5f));
  EXPECT_FALSE(MeanAround(image, 2.4f, 2.5f));
  EXPECT_FALSE(MeanAround(image, 2.5f, 2.4f));
  EXPECT_TRUE(MeanAround(image, 17.4f, 13.4f));
  EXPECT_FALSE(MeanAround(image, 17.6f, 13.4f));
  EXPECT_FALSE(MeanAround(image, 17.4f, 13.6f));
}

}  // namespace
}  // namespace phi
