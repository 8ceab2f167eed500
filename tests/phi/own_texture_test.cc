#include "phi/filtering/own_texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "phi/base/image_noise.h"

namespace phi {
namespace {

constexpr int kSide = 40;

// Columns in threes of 127 and of `bright`. Smoothed by 3 they rise and fall by a third of the difference d a column: 0, 1/3,
// 2/3, 1, 2/3, 1/3 of d and so on.
GrayImage Stripes(std::uint8_t bright) {
  GrayImage image(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) image(x, y) = x / 3 % 2 == 0 ? 127 : bright;
  }
  return image;
}

double KeptShare(const GrayImage& image) {
  MeasurementMap map = AllMeasured(PlaneMap(image.width(), image.height(), {{0, 0, -1}, 3}));
  DropPlainPixels(FindOwnTexture(image, NoiseDeviation(image.view())), &map);
  int kept = 0;
  for (const PlaneHypothesis& h : map.planes) kept += h.depth > 0;
  return static_cast<double>(kept) / static_cast<double>(map.size());
}

// Of five neighbouring values with mean m and slope s, least squares leaves mean(v^2) - m^2 - 2 s^2:
//   1/3 2/3 1 2/3 1/3: 0.062 d^2 (slope 0);  0 1/3 2/3 1 2/3: 0.116 d^2 - 0.080 d^2 = 0.036 d^2, and these reversed;
//   0 0 1/3 2/3 1 at the left border: 0.151 d^2 - 0.142 d^2 = 0.009 d^2.
// So d = 1 stays below 0.125 everywhere, and d = 4 above it.
TEST(OwnTexture, NeedsAnEighthOfASquaredGreyLevel) {
  EXPECT_EQ(KeptShare(Stripes(127)), 0);
  EXPECT_EQ(KeptShare(Stripes(128)), 0);
  EXPECT_EQ(KeptShare(Stripes(131)), 1);
}

// A spot of one pixel is smoothed to 3 x 3, and lies in the 5 x 5 around those up to three pixels away.
TEST(OwnTexture, IsOfThePixelsAroundInBothDirections) {
  GrayImage image(kSide, kSide, 100);
  image(17, 22) = 200;
  const Array2D<float> variance = FindOwnTexture(image, 0).variance;
  for (int y = 5; y < kSide - 5; ++y) {
    for (int x = 5; x < kSide - 5; ++x) {
      const bool is_near = std::abs(x - 17) <= 3 && std::abs(y - 22) <= 3;
      ASSERT_EQ(variance(x, y) > 0, is_near) << x << ", " << y;
    }
  }
}

// Variance 18 in 5 x 5 pixels, along either axis and across, but nothing that tells one place from the next.
TEST(OwnTexture, ShadingIsNone) {
  GrayImage across(kSide, kSide), down(kSide, kSide), both(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      across(x, y) = static_cast<std::uint8_t>(20 + 3 * x);
      down(x, y) = static_cast<std::uint8_t>(200 - 3 * y);
      both(x, y) = static_cast<std::uint8_t>(20 + 3 * x + y);
    }
  }
  for (const GrayImage* image : {&across, &down, &both}) EXPECT_EQ(KeptShare(*image), 0);
}

GrayImage AddNoise(GrayImage image, double deviation) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, deviation);
  for (std::uint8_t& value : image) {
    value = static_cast<std::uint8_t>(std::clamp<long>(std::lround(value + noise(random)), 0, 255));
  }
  return image;
}

TEST(OwnTexture, WhiteNoiseLeavesTheStatedShare) {
  const GrayImage noisy = AddNoise(GrayImage(400, 400, 128), 8);
  double sum = 0;
  for (const float variance : FindOwnTexture(noisy, 8).variance) sum += variance;
  EXPECT_NEAR(sum / (400 * 400), 0.467 * (64 + 1.0 / 12) / 9, 0.05);
}

// White noise of one grey level has a variance of 1 and, smoothed by 9 pixels, of 1/9. Most of a ninth of the noise's variance is
// granted; the 5 x 5 pixels, whose values overlap, mostly have less.
TEST(OwnTexture, NoiseIsMostlyNone) {
  const GrayImage plain(200, 200, 128);
  for (const double deviation : {1, 2, 4, 8})
    EXPECT_LT(KeptShare(AddNoise(plain, deviation)), 0.3) << deviation;
}

// (1, 6, 1) / 8 along rows and columns, as much as a camera's or a resampling's own smoothing.
GrayImage Smoothed(const GrayImage& image) {
  GrayImage result(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      double sum = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int u = std::clamp(x + dx, 0, image.width() - 1), v = std::clamp(y + dy, 0, image.height() - 1);
          sum += image(u, v) * (dx == 0 ? 6 : 1) * (dy == 0 ? 6 : 1) / 64.0;
        }
      }
      result(x, y) = static_cast<std::uint8_t>(std::lround(sum));
    }
  }
  return result;
}

// Smooth noise differs less from pixel to pixel than its deviation says, and loses less in another smoothing: a ninth of what the
// differences tell is too little to grant, and 55 to 75 % of the pixels would have texture.
TEST(OwnTexture, SmoothNoiseIsMostlyNone) {
  const GrayImage plain(200, 200, 128);
  for (const double deviation : {2, 4, 8})
    EXPECT_LT(KeptShare(Smoothed(AddNoise(plain, deviation))), 0.15) << deviation;
}

// All of this facade has texture, so that its quietest part is no measure of noise: what is taken for noise is limited by how the
// image differs from pixel to pixel.
TEST(OwnTexture, TextureEverywhereIsNotTakenForNoise) {
  GrayImage image(200, 200);
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      image(x, y) = static_cast<std::uint8_t>(std::lround(128 + 12 * std::sin(0.7 * x) * std::sin(0.6 * y)));
    }
  }
  EXPECT_GT(KeptShare(AddNoise(image, 1)), 0.99);
}

// Stripes of d = 40 differ from a plane by at least 0.036 d^2 = 57, noise of 8 grey levels by 64 / 9 = 7.
TEST(OwnTexture, TextureStaysWhereNoiseIs) {
  GrayImage image(200, 200, 128);
  for (int y = 0; y < 200; ++y) {
    for (int x = 100; x < 200; ++x) image(x, y) = x / 3 % 2 == 0 ? 108 : 148;
  }
  MeasurementMap map = AllMeasured(PlaneMap(200, 200, {{0, 0, -1}, 3}));
  const GrayImage noisy = AddNoise(image, 8);
  DropPlainPixels(FindOwnTexture(noisy, NoiseDeviation(noisy.view())), &map);
  int num_plain = 0;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 95; ++x) num_plain += map.planes(x, y).depth > 0;
    for (int x = 100; x < 200; ++x) EXPECT_GT(map.planes(x, y).depth, 0) << x << ", " << y;
  }
  EXPECT_LT(num_plain, 0.3 * 95 * 200);
}

// An edge counts for the pixels within 3 of it (2, and 1 of the smoothing) and no farther, however strong it is; without those
// beside a plain patch's middle, for one less.
TEST(OwnTexture, AnEdgeBelongsToThePixelsBesideIt) {
  GrayImage image(kSide, kSide, 0);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 20; x < kSide; ++x) image(x, y) = 255;
  }
  const auto kept = [&](int plain_reach) {
    MeasurementMap map = AllMeasured(PlaneMap(kSide, kSide, {{0, 0, -1}, 3}));
    DropPlainPixels(FindOwnTexture(image, NoiseDeviation(image.view()), 1, plain_reach), &map);
    std::vector<int> columns;
    for (int x = 0; x < kSide; ++x) {
      if (map.planes(x, 7).depth > 0) columns.push_back(x);
    }
    return columns;
  };
  EXPECT_EQ(kept(0), (std::vector{17, 18, 19, 20, 21, 22}));
  EXPECT_EQ(kept(1), (std::vector{18, 19, 20, 21}));
  EXPECT_EQ(kept(2), (std::vector{19, 20}));
  EXPECT_EQ(kept(kPlainReach), kept(1));
}

TEST(OwnTexture, DropsDepthAndNormalOfPlainPixelsOnly) {
  GrayImage image = Stripes(200);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < 20; ++x) image(x, y) = 90;
  }
  PlaneMap planes(kSide, kSide, {{0, 0, -1}, 3});
  planes(30, 15).depth = 0;
  MeasurementMap map = AllMeasured(planes);
  DropPlainPixels(FindOwnTexture(image, NoiseDeviation(image.view())), &map);
  EXPECT_EQ(map.planes(5, 5).depth, 0);
  EXPECT_EQ(map.planes(5, 5).normal.z, 0);
  EXPECT_EQ(map.planes(30, 5).depth, 3);
  EXPECT_EQ(map.planes(30, 5).normal.z, -1);
  EXPECT_EQ(map.planes(30, 15).depth, 0);
}

}  // namespace
}  // namespace phi
