#include "phi/base/image_noise.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace phi {
namespace {

using Image = Array2D<std::uint8_t>;

// `brightness` of x and y, with white noise.
template <typename Brightness>
Image MakeImage(int width, int height, double deviation, const Brightness& brightness) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, deviation);
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const long value = std::lround(brightness(x, y) + noise(random));
      image(x, y) = static_cast<std::uint8_t>(std::clamp(value, 0L, 255L));
    }
  }
  return image;
}

// Rounding adds a variance of 1 / 12. Means over a block of 256 pixels, whose differences overlap, scatter by 8 %, so that the tenth
// of all blocks that tells lies a tenth below their mean.
TEST(ImageNoise, IsThatOfAShadedWall) {
  for (const double deviation : {1.0, 2.0, 5.0, 10.0}) {
    const Image image = MakeImage(300, 200, deviation, [](int x, int y) { return 100 + 0.2 * x - 0.1 * y; });
    const double expected = 0.9 * std::sqrt(deviation * deviation + 1.0 / 12);
    EXPECT_NEAR(NoiseDeviation(image.view()), expected, 0.04 * deviation) << deviation;
  }
}

TEST(ImageNoise, ComesFromTheLeastTexturedTenth) {
  // Four fifths are a checkerboard of 30 grey levels.
  const Image image =
      MakeImage(320, 320, 2, [](int x, int y) { return x < 64 ? 120 : 120 + 30 * ((x / 2 + y / 2) % 2); });
  EXPECT_NEAR(NoiseDeviation(image.view()), 2, 0.2);
}

TEST(ImageNoise, LeavesOutWhatIsCutOff) {
  // The sky is white without any noise.
  const Image image = MakeImage(320, 320, 3, [](int x, int) { return x < 160 ? 400 : 120; });
  EXPECT_NEAR(NoiseDeviation(image.view()), 2.7, 0.2);
}

TEST(ImageNoise, IsZeroWhereNothingTells) {
  EXPECT_EQ(NoiseDeviation(Image(300, 300, 90).view()), 0);
  EXPECT_EQ(NoiseDeviation(Image(300, 300, 255).view()), 0);
  EXPECT_EQ(NoiseDeviation(MakeImage(40, 40, 5, [](int, int) { return 120; }).view()), 0) << "too small";
  EXPECT_EQ(NoiseDeviation(Image(1, 1, 90).view()), 0);
}

}  // namespace
}  // namespace phi
