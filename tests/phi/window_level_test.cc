#include "phi/matching/window_level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "phi/matching/pyramid.h"

namespace phi {
namespace {

// A vertical sine of the given amplitude (grey levels; variance amplitude^2 / 2) and wavelength (pixels).
GrayImage Sine(double amplitude, double wavelength) {
  GrayImage image(256, 256);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      image(x, y) = static_cast<std::uint8_t>(
          std::lround(128 + amplitude * std::sin(2 * M_PI * (x + 0.5) / wavelength)));
    }
  }
  return image;
}

int Level(const GrayImage& image, int num_levels) {
  const std::vector<GrayImage> coarse = BuildPyramid(image, num_levels);
  std::vector<GraySampler> levels = {{image.view()}};
  for (const GrayImage& level : coarse) levels.push_back({level.view()});
  return SelectWindowScale(levels.data(), num_levels, MatchingWindow{}, 128.5f, 128.5f).level;
}

bool IsNarrow(const GrayImage& image, float narrow_step) {
  const GraySampler level = {image.view()};
  MatchingWindow window;
  window.narrow_step = narrow_step;
  return SelectWindowScale(&level, 1, window, 128.5f, 128.5f).is_narrow;
}

TEST(WindowLevel, StrongTextureStaysAtFullResolution) { EXPECT_EQ(Level(Sine(20, 10), 4), 0); }

// Variance 2 is below 3 at level 0; at level 1 the needed variance is 0.75 and a long wave keeps its own.
TEST(WindowLevel, FaintTextureTakesALargerWindow) { EXPECT_EQ(Level(Sine(2, 40), 4), 1); }

// A wall whose window reaches onto a bright frame: the frame's edge is no texture of the wall.
TEST(WindowLevel, ContrastOfAnotherSurfaceDoesNotCount) {
  GrayImage image(256, 256, 128);
  for (int y = 0; y < 256; ++y) {
    for (int x = 131; x < 256; ++x) image(x, y) = 220;
  }
  const std::vector<GrayImage> coarse = BuildPyramid(image, 2);
  const std::vector<GraySampler> levels = {{image.view()}, {coarse[0].view()}};
  MatchingWindow window;
  EXPECT_EQ(SelectWindowScale(levels.data(), 2, window, 128.5f, 128.5f).level, 0);
  window.weight_decay = 1.0f / 81;
  EXPECT_EQ(SelectWindowScale(levels.data(), 2, window, 128.5f, 128.5f).level, 1);
}

WindowScale ScaleAt(const GrayImage& image, int x) {
  const std::vector<GrayImage> coarse = BuildPyramid(image, 3);
  const std::vector<GraySampler> levels = {{image.view()}, {coarse[0].view()}, {coarse[1].view()}};
  MatchingWindow window;
  window.narrow_step = 1;
  window.weight_decay = 1.0f / 81;
  window.range_follows_texture = true;
  return SelectWindowScale(levels.data(), 3, window, x + 0.5f, 128.5f);
}

// Brightness spread evenly over all grey levels fills the range of 9 around the centre, which then is 18: half the weight
// there.
TEST(WindowLevel, TheRangeOfATexturedSurfaceIsTwiceAsWide) {
  GrayImage noise(256, 256);
  std::mt19937 random(5);
  for (std::uint8_t& value : noise) value = static_cast<std::uint8_t>(random() >> 24);
  int sum = 0;
  for (int x = 60; x < 200; ++x) sum += ScaleAt(noise, x).range_step;
  EXPECT_GT(sum, 140 * 5.5);
  MatchingWindow window;
  window.weight_decay = 1.0f / 81;
  EXPECT_FLOAT_EQ(WindowAtScale(window, {0, false, kMaxRangeStep}).Weight(18), 0.5f);
  EXPECT_FLOAT_EQ(WindowAtScale(window, {0, false, 0}).Weight(9), 0.5f);
}

// Paint of two grey levels of contrast beside a frame: the frame's side has no weight, and must not widen the range.
TEST(WindowLevel, TheRangeOfAPlainSurfaceBesideAnEdgeStays) {
  GrayImage image = Sine(2, 10);
  for (int y = 0; y < 256; ++y) {
    for (int x = 131; x < 256; ++x) image(x, y) = 220;
  }
  EXPECT_EQ(ScaleAt(image, 128).range_step, 0);
}

// A variance of 1 / (2 ln 2 / 81) = 58.4 squared grey levels is that of evenly spread brightness; a quarter of it is two steps.
TEST(WindowLevel, TheRangeGrowsWithTheVariance) {
  MatchingWindow window;
  window.weight_decay = 1.0f / 81;
  window.range_follows_texture = true;
  EXPECT_EQ(RangeStep(window, 0), 0);
  EXPECT_EQ(RangeStep(window, 14.6f), 2);
  EXPECT_EQ(RangeStep(window, 58.5f), kMaxRangeStep);
  EXPECT_EQ(RangeStep(window, 200), kMaxRangeStep);
  window.weight_decay = 0;  // all samples count the same, whatever their variance
  EXPECT_EQ(RangeStep(window, 200), 0);
  window.weight_decay = 1.0f / 81;
  window.range_follows_texture = false;
  EXPECT_EQ(RangeStep(window, 200), 0);
}

// The narrow window needs variance 10: amplitude 20 has 200, amplitude 4 has 8.
TEST(WindowLevel, RichTextureTakesTheNarrowWindow) {
  EXPECT_TRUE(IsNarrow(Sine(20, 10), 1));
  EXPECT_FALSE(IsNarrow(Sine(4, 10), 1));
  EXPECT_FALSE(IsNarrow(Sine(20, 10), 0));
}

// Twice the noise's variance: with noise of 1.8 grey levels 6.5, which an amplitude of 4 (8) has and one of 2 (2) has not.
TEST(WindowLevel, CleanImagesTakeTheNarrowWindowForFainterTexture) {
  MatchingWindow window;
  window.narrow_step = 1;
  window.narrow_variance = NarrowWindowVariance(1.8);
  const auto is_narrow = [&](const GrayImage& image) {
    const GraySampler level = {image.view()};
    return SelectWindowScale(&level, 1, window, 128.5f, 128.5f).is_narrow;
  };
  EXPECT_TRUE(is_narrow(Sine(4, 10)));
  EXPECT_FALSE(is_narrow(Sine(2, 10)));
  EXPECT_FLOAT_EQ(NarrowWindowVariance(0), 1);
  EXPECT_FLOAT_EQ(NarrowWindowVariance(20), 10);
}

// The whole window at full size needs 3, or a tenth more than the noise's own variance: with 4 grey levels 17.6.
TEST(WindowLevel, NoiseIsNoTexture) {
  EXPECT_FLOAT_EQ(LevelVariance(0), 3);
  EXPECT_FLOAT_EQ(LevelVariance(1), 3);
  EXPECT_FLOAT_EQ(LevelVariance(4), 17.6f);
  EXPECT_FLOAT_EQ(LevelVariance(4, 0.5f), 8.8f);
}

// Texture that only the wide window reaches does not make the narrow one good.
TEST(WindowLevel, TextureBeyondTheNarrowWindowDoesNotCount) {
  GrayImage image(256, 256, 128);
  for (int y = 0; y < 256; ++y) {
    for (int x = 134; x < 256; ++x) image(x, y) = x % 2 == 0 ? 100 : 150;  // 6 pixels from the centre
  }
  EXPECT_FALSE(IsNarrow(image, 1));
  EXPECT_TRUE(IsNarrow(image, 1.4f));
}

TEST(WindowLevel, NoTextureTakesTheCoarsest) {
  EXPECT_EQ(Level(Sine(0, 40), 3), 2);
  EXPECT_EQ(Level(Sine(0, 40), 1), 0);
}

TEST(WindowLevel, HomographyBetweenReducedImagesAgreesWithTheFullOne) {
  const Mat3f h = {{1.1f, 0.02f, 30, -0.03f, 0.95f, -12, 1e-4f, -2e-4f, 1.02f}};
  const Vec3f full = Transform(h, 300.5f, 200.5f);
  const Vec3f half = Transform(ScaleHomography(h, 0.5f), 150.25f, 100.25f);
  EXPECT_NEAR(half.x / half.z, 0.5 * full.x / full.z, 1e-4);
  EXPECT_NEAR(half.y / half.z, 0.5 * full.y / full.z, 1e-4);
}

TEST(Pyramid, HalvingAveragesBlocksAndKeepsOddEdges) {
  GrayImage image(3, 2);
  image(0, 0) = 10, image(1, 0) = 20, image(2, 0) = 100;
  image(0, 1) = 30, image(1, 1) = 40, image(2, 1) = 50;
  const GrayImage half = HalveImage(image);
  ASSERT_EQ(half.width(), 2);
  ASSERT_EQ(half.height(), 1);
  EXPECT_EQ(half(0, 0), 25);
  EXPECT_EQ(half(1, 0), 75);
}

}  // namespace
}  // namespace phi
