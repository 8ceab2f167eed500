#include "phi/filtering/own_texture.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/box_sums.h"
#include "phi/base/image_noise.h"
#include "phi/base/join_squares.h"
#include "phi/base/whole_array.h"
#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

constexpr int kSide = kOwnTextureSide;

// Sums over columns of kSide values: of the values, of their squares, of the values times the distance from the middle row.
PHI_WIDE_VECTORS void SumColumns(const std::uint16_t* const (&rows)[kSide], int width, std::int32_t* sums, std::int32_t* squares,
                                 std::int32_t* down) {
  for (int x = 0; x < width; ++x) {
    std::int32_t sum = 0, square = 0, moment = 0;
    for (int v = 0; v < kSide; ++v) {
      const std::int32_t value = rows[v][x];
      sum += value;
      square += value * value;
      moment += value * (v - kOwnTextureRadius);
    }
    sums[x] = sum;
    squares[x] = square;
    down[x] = moment;
  }
}

// Of the square that begins with each of `count` columns.
PHI_WIDE_VECTORS void FindVariances(const std::int32_t* sums, const std::int32_t* squares, const std::int32_t* down, int count,
                                    float* variances) {
  for (int x = 0; x < count; ++x) {
    std::int32_t sum = 0, square = 0, moment = 0, across = 0;
    for (int u = 0; u < kSide; ++u) {
      sum += sums[x + u];
      square += squares[x + u];
      moment += down[x + u];
      across += sums[x + u] * (u - kOwnTextureRadius);
    }
    variances[x] = VarianceAboutPlane(sum, square, across, moment);
  }
}

// Of row y, around each pixel; at the border of the nearest square.
void FindVarianceRow(const Array2D<std::uint16_t>& sums, int y, float* variances) {
  const int width = sums.width(), y0 = FirstOfSurroundings(y, sums.height());
  const std::uint16_t* rows[kSide];
  for (int v = 0; v < kSide; ++v) rows[v] = &sums(0, y0 + v);
  std::vector<std::int32_t> columns(width), squares(width), down(width);
  SumColumns(rows, width, columns.data(), squares.data(), down.data());
  const int count = width - kSide + 1;
  FindVariances(columns.data(), squares.data(), down.data(), count, variances + kOwnTextureRadius);
  std::fill(variances, variances + kOwnTextureRadius, variances[kOwnTextureRadius]);
  std::fill(variances + kOwnTextureRadius + count, variances + width, variances[kOwnTextureRadius + count - 1]);
}

}  // namespace

float LeastOwnVariance(double noise, double scale) {
  return static_cast<float>(scale * std::max(kMinOwnVariance, kNoiseShare * noise * noise));
}

OwnTexture FindOwnTexture(const GrayImage& image, double noise, double scale, int plain_reach) {
  OwnTexture texture{Array2D<float>(image.width(), image.height()), {}};
  if (!HasSurroundings(image.width(), image.height())) {
    texture.is_plain = Mask(image.width(), image.height());
    return texture;
  }
  const Array2D<std::uint16_t> sums = SumBoxes3x3(image.view());
  tbb::parallel_for(0, image.height(), [&](int y) { FindVarianceRow(sums, y, &texture.variance(0, y)); });
  const float least = LeastOwnVariance(noise, scale);
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
