#include "phi/filtering/own_texture.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <tbb/parallel_for.h>

#include "phi/base/box_sums.h"
#include "phi/base/image_noise.h"
#include "phi/base/join_squares.h"
#include "phi/base/whole_array.h"

namespace phi {
namespace {

constexpr int kSumsPerGreyLevel = 9;  // of the smoothed image
constexpr int kSide = 2 * kOwnTextureRadius + 1;

// Mean squared difference of the sums around (x, y), at the border of the nearest that many, from a plane of brightness.
double SumsVariance(const Array2D<std::uint16_t>& sums, int x, int y) {
  const int x0 = std::clamp(x - kOwnTextureRadius, 0, sums.width() - kSide);
  const int y0 = std::clamp(y - kOwnTextureRadius, 0, sums.height() - kSide);
  std::int32_t sum = 0, squares = 0;
  std::int32_t across = 0, down = 0;  // values times the distance from the middle column, row
  for (int v = 0; v < kSide; ++v) {
    const std::uint16_t* row = &sums(x0, y0 + v);
    std::int32_t row_sum = 0;
    for (int u = 0; u < kSide; ++u) {
      const std::int32_t value = row[u];
      row_sum += value;
      squares += value * value;
      across += value * (u - kOwnTextureRadius);
    }
    sum += row_sum;
    down += row_sum * (v - kOwnTextureRadius);
  }
  // Least squares: mean and slopes are independent over a square. Squared distances from its middle line add up to kSpread.
  constexpr std::int64_t kCount = kSide * kSide;
  constexpr std::int64_t kSpread = kCount * (kSide * kSide - 1) / 12;
  static_assert(kSpread % kCount == 0);
  const auto square = [](std::int64_t value) { return value * value; };
  const std::int64_t residual =
      kSpread * squares - kSpread / kCount * square(sum) - square(across) - square(down);
  return static_cast<double>(residual) / static_cast<double>(kCount * kSpread);
}

// Of the block of pixels from (x0, y0) on.
double MeanOfBlock(const Array2D<float>& values, int x0, int y0) {
  double sum = 0;
  for (int y = y0; y < y0 + kNoiseBlock; ++y) {
    for (int x = x0; x < x0 + kNoiseBlock; ++x) sum += values(x, y);
  }
  return sum / (kNoiseBlock * kNoiseBlock);
}

// The variance that is granted to noise.
double NoiseVariance(const GrayImage& image, const Array2D<float>& variance, double noise) {
  const double quiet = OfQuietBlocks(image.view(), [&](int x0, int y0) { return MeanOfBlock(variance, x0, y0); });
  const double squared = noise * noise;
  return std::clamp(quiet / kShareAboutPlane, squared / kSumsPerGreyLevel, squared);
}

}  // namespace

OwnTexture FindOwnTexture(const GrayImage& image, double noise, double scale, int plain_reach) {
  OwnTexture texture{Array2D<float>(image.width(), image.height()), {}};
  if (image.width() < kSide || image.height() < kSide) {
    texture.is_plain = Mask(image.width(), image.height());
    return texture;
  }
  const Array2D<std::uint16_t> sums = SumBoxes3x3(image.view());
  constexpr double kSquaredSums = kSumsPerGreyLevel * kSumsPerGreyLevel;
  tbb::parallel_for(0, image.height(), [&](int y) {
    for (int x = 0; x < image.width(); ++x) {
      texture.variance(x, y) = static_cast<float>(SumsVariance(sums, x, y) / kSquaredSums);
    }
  });
  const auto least =
      static_cast<float>(scale * std::max(kMinOwnVariance, NoiseVariance(image, texture.variance, noise)));
  const Mask is_plain = Transformed(texture.variance, [least](float variance) -> std::uint8_t { return variance < least; });
  texture.is_plain = Mask::Uninitialized(image.width(), image.height());
  tbb::parallel_for(0, image.height(), [&](int y) {
    const auto either = [](std::uint8_t a, std::uint8_t b) -> std::uint8_t { return a | b; };
    JoinSquares(is_plain, plain_reach, y, either, &texture.is_plain(0, y));
  });
  return texture;
}

void DropPlainPixels(const OwnTexture& texture, MeasurementMap* map) {
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (texture.is_plain.data()[i] != 0) map->Drop(i);
    }
  });
}

}  // namespace phi
