// Pixels that have no texture of their own are not measured, whatever their window matched.
//
// On a plain wall beside a sofa a window's only contrast is the sofa's edge. It matches at the sofa's depth, and it does so in
// every view, so that the views confirm each other's error; and a wall's planes would rest on such pixels. Without them
// the planes of what surely was measured decide about the wall (paper section E). Nor is shading texture: a plane of
// brightness matches wherever it is laid.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/base/images.h"
#include "phi/measurement.h"

namespace phi {

inline constexpr int kOwnTextureRadius = 2;  // pixels: 5 x 5 of them are the pixel's own surroundings
// Mean squared difference of the image, smoothed by 3 x 3 pixels, from a plane of brightness; squared grey levels. A
// sensor's noise loses nearly all of its variance in the smoothing, the faint texture of a sharp or of an enlarged photo
// does not.
inline constexpr double kMinOwnVariance = 0.125;
// White noise loses eight ninths of its variance in the smoothing, and leaves 0.467 of the last ninth about a plane of 5 x 5 such
// pixels: the trace of (1 - P) C / 25, where C is the smoothing's covariance and P projects onto planes. Of 100 pixels 8 have more
// than 0.8 of the ninth, so much is granted to noise: plain patches around them drop these as well.
inline constexpr double kNoiseShare = 0.8 / 9;

// Contrast that only touches the surroundings is another surface's: pixels so far around the middle of a plain patch of 5 x 5 are
// plain as well.
inline constexpr int kPlainReach = 1;

inline constexpr int kOwnTextureSide = 2 * kOwnTextureRadius + 1;
inline constexpr int kBoxSumsPerGreyLevel = 9;  // of the smoothed image

// Of kOwnTextureSide squared sums of 3 x 3 pixels: the mean squared difference from a plane of brightness, squared grey levels. sum and
// square: of the values; across, down: of the values times the distance from the middle column and row. Whole numbers that a double holds
// exactly.
PHI_HD float VarianceAboutPlane(std::int32_t sum, std::int32_t square, std::int32_t across, std::int32_t down) {
  // Least squares: mean and slopes are independent over a square. Squared distances from its middle line add up to kSpread.
  constexpr int kCount = kOwnTextureSide * kOwnTextureSide, kSpread = kCount * (kOwnTextureSide * kOwnTextureSide - 1) / 12;
  static_assert(kSpread % kCount == 0);
  constexpr double kSquaredSums = kBoxSumsPerGreyLevel * kBoxSumsPerGreyLevel;
  const double s = sum, a = across, d = down;
  const double residual = kSpread * static_cast<double>(square) - kSpread / kCount * (s * s) - a * a - d * d;
  return static_cast<float>(residual / (static_cast<double>(kCount) * kSpread) / kSquaredSums);
}

// First column or row of the surroundings of pixel i, of `size`: at the border the nearest ones.
PHI_HD int FirstOfSurroundings(int i, int size) {
  const int first = i - kOwnTextureRadius, last = size - kOwnTextureSide;
  return first < 0 ? 0 : first > last ? last : first;
}

// False: images of that size have no variance, and nothing in them is plain.
PHI_HD bool HasSurroundings(int width, int height) { return width >= kOwnTextureSide && height >= kOwnTextureSide; }

// OwnTexture::variance of one pixel. sums: SumBoxes3x3 of the image.
PHI_HD float OwnVarianceAt(ArrayView2D<const std::uint16_t> sums, int x, int y) {
  if (!HasSurroundings(sums.width, sums.height)) return 0;
  const int x0 = FirstOfSurroundings(x, sums.width), y0 = FirstOfSurroundings(y, sums.height);
  std::int32_t sum = 0, square = 0, across = 0, down = 0;
  for (int v = 0; v < kOwnTextureSide; ++v) {
    for (int u = 0; u < kOwnTextureSide; ++u) {
      const std::int32_t value = sums(x0 + u, y0 + v);
      sum += value;
      square += value * value;
      across += value * (u - kOwnTextureRadius);
      down += value * (v - kOwnTextureRadius);
    }
  }
  return VarianceAboutPlane(sum, square, across, down);
}

// The variance below which a pixel is plain. scale: of the limits.
float LeastOwnVariance(double noise, double scale);

// Of each pixel; images smaller than the surroundings have no variance, and nothing in them is plain.
struct OwnTexture {
  Array2D<float> variance;  // squared grey levels
  Mask is_plain;            // not 0: less than kMinOwnVariance, or than noise makes, here or up to `plain_reach` pixels away
};

// `noise`: NoiseDeviation, grey levels. scale: of the limits below which a pixel is plain; plain_reach: pixels.
OwnTexture FindOwnTexture(const GrayImage& image, double noise, double scale = 1, int plain_reach = kPlainReach);

// Drops the plain pixels. The map has the image's size.
void DropPlainPixels(const OwnTexture& texture, MeasurementMap* map);

}  // namespace phi
