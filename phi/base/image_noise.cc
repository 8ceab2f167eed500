#include "phi/base/image_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <vector>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

// Mean brightness of a block between which noise is not cut off.
constexpr int kDarkest = 16, kBrightest = 240;
constexpr std::size_t kMinBlocks = 20;
constexpr double kQuietShare = 0.1;
constexpr int kPixels = kNoiseBlock * kNoiseBlock;

bool IsWellExposed(ArrayView2D<const std::uint8_t> image, int x0, int y0) {
  int brightness = 0;
  for (int y = y0; y < y0 + kNoiseBlock; ++y) {
    for (int x = x0; x < x0 + kNoiseBlock; ++x) brightness += image(x, y);
  }
  return brightness >= kDarkest * kPixels && brightness <= kBrightest * kPixels;
}

// Sum of the block's second differences. The block and the pixels beside it lie inside the image.
int SumDifferences(ArrayView2D<const std::uint8_t> image, int x0, int y0) {
  int differences = 0;
  for (int y = y0; y < y0 + kNoiseBlock; ++y) {
    const std::uint8_t *above = &image(0, y - 1), *row = &image(0, y), *below = &image(0, y + 1);
    for (int x = x0; x < x0 + kNoiseBlock; ++x) {
      const auto across = [x](const std::uint8_t* r) { return r[x - 1] - 2 * r[x] + r[x + 1]; };
      differences += std::abs(across(above) - 2 * across(row) + across(below));
    }
  }
  return differences;
}

}  // namespace

double OfQuietBlocks(ArrayView2D<const std::uint8_t> image, const std::function<double(int x0, int y0)>& of_block) {
  constexpr double kUnusable = -1;
  const int columns = std::max(0, image.width - 2) / kNoiseBlock, rows = std::max(0, image.height - 2) / kNoiseBlock;
  std::vector<double> values(static_cast<std::size_t>(columns) * rows);
  tbb::parallel_for(0, rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      const int x0 = 1 + column * kNoiseBlock, y0 = 1 + row * kNoiseBlock;
      values[static_cast<std::size_t>(row) * columns + column] =
          IsWellExposed(image, x0, y0) ? of_block(x0, y0) : kUnusable;
    }
  });
  std::erase(values, kUnusable);
  if (values.size() < kMinBlocks) return 0;
  const auto quiet = values.begin() + static_cast<std::ptrdiff_t>(kQuietShare * static_cast<double>(values.size()));
  std::nth_element(values.begin(), quiet, values.end());
  return *quiet;
}

double NoiseDeviation(ArrayView2D<const std::uint8_t> image) {
  const double differences = OfQuietBlocks(image, [&](int x0, int y0) { return SumDifferences(image, x0, y0); });
  // The mean size of a normal variable is sqrt(2 / pi) of its standard deviation.
  return differences * std::sqrt(M_PI / 2) / (6 * kPixels);
}

}  // namespace phi
