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

// Rounding adds a variance of 1 / 12.
TEST(ImageNoise, IsThatOfAShadedWall) {
  for (const double deviation : {1.0, 2.0, 5.0, 10.0}) {
    const Image image = MakeImage(900, 600, deviation, [](int x, int y) { return 100 + 0.1 * x - 0.1 * y; });
    const double expected = std::sqrt(deviation * deviation + 1.0 / 12);
    EXPECT_NEAR(NoiseDeviation(image.view()), expected, 0.04 * deviation) << deviation;
  }
}

// JPEG takes the finest of an image's frequencies. Here a mean with the neighbours does, (1, 6, 1) / 8 along both axes. Along an axis a cell's
// mean then has the weights (1, 7, 8, 7, 1) / 24: a variance of 164 / 576 of a pixel's, and a covariance of 14 / 576 with the next cell's,
// so that a second difference has (6 * 164 - 8 * 14) / 576 = 1.51 where white noise has 6 / 3: 0.757 of the deviation over both axes. Differences
// from pixel to pixel say less than half.
TEST(ImageNoise, IsFoundWhereJpegTookTheFinestOfIt) {
  constexpr double kDeviation = 6;
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, kDeviation);
  Array2D<double> rough(900, 600);
  for (double& value : rough) value = 120 + noise(random);
  Image image(900, 600, 120);
  for (int y = 1; y < 599; ++y) {
    for (int x = 1; x < 899; ++x) {
      double sum = 0;
      for (int v = -1; v <= 1; ++v) {
        for (int u = -1; u <= 1; ++u) sum += (u == 0 ? 6 : 1) * (v == 0 ? 6 : 1) * rough(x + u, y + v);
      }
      image(x, y) = static_cast<std::uint8_t>(std::lround(sum / 64));
    }
  }
  EXPECT_NEAR(NoiseDeviation(image.view()), 0.757 * kDeviation, 0.03 * kDeviation);
}

// The quietest fiftieth are a tenth of what is plain, and a little noisier than a fiftieth of that.
TEST(ImageNoise, ComesFromTheLeastTexturedPart) {
  // Four fifths are a checkerboard of 30 grey levels.
  const Image image =
      MakeImage(960, 960, 2, [](int x, int y) { return x < 192 ? 120 : 120 + 30 * ((x / 2 + y / 2) % 2); });
  EXPECT_NEAR(NoiseDeviation(image.view()), 2, 0.3);
}

// Where all of an image has texture over a few pixels, the finest differences bound what is taken for noise.
TEST(ImageNoise, SoftTextureIsNotAllTakenForNoise) {
  const auto waves = [](int x, int y) { return 120 + 20 * std::sin(0.7 * x) * std::sin(0.7 * y); };
  const Image image = MakeImage(900, 600, 0.5, waves);
  EXPECT_LT(NoiseDeviation(image.view()), 6);
}

TEST(ImageNoise, LeavesOutWhatIsCutOff) {
  // The sky is white without any noise.
  const Image image = MakeImage(960, 960, 3, [](int x, int) { return x < 480 ? 400 : 120; });
  EXPECT_NEAR(NoiseDeviation(image.view()), 3, 0.2);
}

TEST(ImageNoise, IsZeroWhereNothingTells) {
  EXPECT_EQ(NoiseDeviation(Image(300, 300, 90).view()), 0);
  EXPECT_EQ(NoiseDeviation(Image(300, 300, 255).view()), 0);
  EXPECT_EQ(NoiseDeviation(MakeImage(40, 40, 5, [](int, int) { return 120; }).view()), 0) << "too small";
  EXPECT_EQ(NoiseDeviation(Image(1, 1, 90).view()), 0);
}

}  // namespace
}  // namespace phi
