#include "phi/base/image_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

using Grey = ArrayView2D<const std::uint8_t>;

// Mean brightness of a block between which noise is not cut off.
constexpr int kDarkest = 16, kBrightest = 240;
constexpr std::size_t kMinBlocks = 20;
constexpr double kQuietShare = 0.02;
constexpr int kCell = 3;  // pixels on a side
// JPEG leaves at least this share of the noise from pixel to pixel (a fifth at quality 85, a third at 95).
constexpr double kLeastFineShare = 0.2;

// Side of a block, in pixels or cells, and the deviation that its quietest fiftieth shows of white noise, over the noise's own
// (simulated: the luckiest blocks are quieter than the others).
struct BlockShape {
  int side;
  double quiet_over_true;
};
constexpr BlockShape kBlock = {16, 0.832}, kBlockOfCells = {10, 0.746};

// Sums over cells of 3 x 3 pixels, side by side.
Array2D<std::uint16_t> SumCells(Grey image) {
  Array2D<std::uint16_t> sums(image.width / kCell, image.height / kCell);
  tbb::parallel_for(0, sums.height(), [&](int y) {
    for (int v = 0; v < kCell; ++v) {
      const std::uint8_t* row = &image(0, kCell * y + v);
      for (int x = 0; x < sums.width(); ++x) sums(x, y) += row[kCell * x] + row[kCell * x + 1] + row[kCell * x + 2];
    }
  });
  return sums;
}

template <typename Value>
bool IsWellExposed(ArrayView2D<const Value> values, int values_per_level, int x0, int y0, int side) {
  std::int32_t sum = 0;
  for (int y = y0; y < y0 + side; ++y) {
    for (int x = x0; x < x0 + side; ++x) sum += values(x, y);
  }
  const std::int32_t level = values_per_level * side * side;
  return sum >= kDarkest * level && sum <= kBrightest * level;
}

// Sum of the block's second differences. The block and what is beside it lie inside the image.
template <typename Value>
std::int32_t SumDifferences(ArrayView2D<const Value> values, int x0, int y0, int side) {
  std::int32_t differences = 0;
  for (int y = y0; y < y0 + side; ++y) {
    const Value *above = &values(0, y - 1), *row = &values(0, y), *below = &values(0, y + 1);
    for (int x = x0; x < x0 + side; ++x) {
      const auto across = [x](const Value* r) { return r[x - 1] - 2 * r[x] + r[x + 1]; };
      differences += std::abs(across(above) - 2 * across(row) + across(below));
    }
  }
  return differences;
}

// Deviation of white noise whose quietest blocks would be as quiet as these; texture only adds to noise. Blocks do not touch the border.
// -1: hardly any part of the image is well exposed.
template <typename Value>
double DeviationOfQuietBlocks(ArrayView2D<const Value> values, int values_per_level, const BlockShape& shape) {
  constexpr double kUnusable = -1;
  const int side = shape.side;
  const int columns = std::max(0, values.width - 2) / side, rows = std::max(0, values.height - 2) / side;
  std::vector<double> means(static_cast<std::size_t>(columns) * rows);
  tbb::parallel_for(0, rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      const int x0 = 1 + column * side, y0 = 1 + row * side;
      means[static_cast<std::size_t>(row) * columns + column] =
          IsWellExposed(values, values_per_level, x0, y0, side)
              ? static_cast<double>(SumDifferences(values, x0, y0, side)) / (side * side)
              : kUnusable;
    }
  });
  std::erase(means, kUnusable);
  if (means.size() < kMinBlocks) return -1;
  const auto quiet = means.begin() + static_cast<std::ptrdiff_t>(kQuietShare * static_cast<double>(means.size()));
  std::nth_element(means.begin(), quiet, means.end());
  // A second difference in both directions, which planes of brightness do not have, of white noise has 6 times its standard deviation; the
  // mean size of a normal variable is sqrt(2 / pi) of its own.
  return *quiet * std::sqrt(std::numbers::pi / 2) / 6 / shape.quiet_over_true;
}

}  // namespace

double NoiseDeviation(Grey image) {
  const double fine = DeviationOfQuietBlocks(image, 1, kBlock);
  if (fine < 0) return 0;
  const Array2D<std::uint16_t> cells = SumCells(image);
  // A cell's sum has kCell times a pixel's deviation.
  const double coarse = DeviationOfQuietBlocks(std::as_const(cells).view(), kCell * kCell, kBlockOfCells) / kCell;
  return coarse < 0 ? fine : std::clamp(coarse, fine, fine / kLeastFineShare);
}

}  // namespace phi
