#include "phi/base/image_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

constexpr int kBlock = 16;  // pixels
// Mean brightness of a block between which noise is not cut off.
constexpr int kDarkest = 16, kBrightest = 240;
constexpr std::size_t kMinBlocks = 20;
constexpr double kQuietShare = 0.1;  // of the blocks: the noisiest of these says the image's noise

constexpr int kUnusable = -1;

// Sum of the block's second differences, or kUnusable. The block and the pixels beside it lie inside the image.
int SumDifferences(ArrayView2D<const std::uint8_t> image, int x0, int y0) {
  int brightness = 0, differences = 0;
  for (int y = y0; y < y0 + kBlock; ++y) {
    const std::uint8_t *above = &image(0, y - 1), *row = &image(0, y), *below = &image(0, y + 1);
    for (int x = x0; x < x0 + kBlock; ++x) {
      const auto across = [x](const std::uint8_t* r) { return r[x - 1] - 2 * r[x] + r[x + 1]; };
      differences += std::abs(across(above) - 2 * across(row) + across(below));
      brightness += row[x];
    }
  }
  constexpr int kPixels = kBlock * kBlock;
  return brightness < kDarkest * kPixels || brightness > kBrightest * kPixels ? kUnusable : differences;
}

}  // namespace

double NoiseDeviation(ArrayView2D<const std::uint8_t> image) {
  const int columns = std::max(0, image.width - 2) / kBlock, rows = std::max(0, image.height - 2) / kBlock;
  std::vector<int> sums(static_cast<std::size_t>(columns) * rows);
  tbb::parallel_for(0, rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      sums[static_cast<std::size_t>(row) * columns + column] =
          SumDifferences(image, 1 + column * kBlock, 1 + row * kBlock);
    }
  });
  std::erase(sums, kUnusable);
  if (sums.size() < kMinBlocks) return 0;
  const auto quiet = sums.begin() + static_cast<std::ptrdiff_t>(kQuietShare * static_cast<double>(sums.size()));
  std::nth_element(sums.begin(), quiet, sums.end());
  // The mean size of a normal variable is sqrt(2 / pi) of its standard deviation.
  return *quiet * std::sqrt(M_PI / 2) / (6 * kBlock * kBlock);
}

}  // namespace phi
