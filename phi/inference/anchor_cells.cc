#include "phi/inference/anchor_cells.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <tbb/parallel_sort.h>

namespace phi {
namespace {

// Of an image's width, and pixels at least: a spot that windows of neighbouring pixels see in common.
constexpr float kCellsAcross = 128, kMinSide = 6;
// A factor of two in depth, so that a cell is a hundredth of its depth deep: a workspace in other units, if their ratio is a
// power of two, has the same cells.
constexpr int kCellsPerOctave = 70;

constexpr int kKeyBits = 20;
constexpr std::int64_t kKeyOffset = std::int64_t{1} << (kKeyBits - 1);

std::uint64_t KeyPart(double cell) { return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(cell)) + kKeyOffset); }

double DepthCell(float w) {
  int exponent;
  const float mantissa = std::frexp(w, &exponent);
  return kCellsPerOctave * exponent + std::floor(kCellsPerOctave * std::log2(mantissa));
}

std::uint64_t KeyOf(const AnchorPoint& p, float side) {
  return KeyPart(p.x / side) << 2 * kKeyBits | KeyPart(p.y / side) << kKeyBits | KeyPart(DepthCell(p.w));
}

int ColumnOf(std::uint64_t key) { return static_cast<int>(static_cast<std::int64_t>(key >> 2 * kKeyBits) - kKeyOffset); }
int RowOf(std::uint64_t key) {
  return static_cast<int>(static_cast<std::int64_t>(key >> kKeyBits & ((1u << kKeyBits) - 1)) - kKeyOffset);
}

}  // namespace

double AnchorTolerance::At(float x, float y, float w) const {
  return std::max(share, deviations * precision.RelativeDeviation(x + 0.5f, y + 0.5f, 1 / w)) * w;
}

float CellSide(int image_width) { return std::max(kMinSide, static_cast<float>(image_width) / kCellsAcross); }

std::vector<AnchorCell> MakeAnchorCells(const std::vector<AnchorPoint>& points, float side, int min_points,
                                        const AnchorTolerance& tolerance) {
  // With the point's place: the same sums whatever the sort does.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  order.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Another program's map may hold a depth whose inverse is beyond numbers.
    if (std::isnormal(points[i].w)) order.emplace_back(KeyOf(points[i], side), static_cast<std::uint32_t>(i));
  }
  tbb::parallel_sort(order.begin(), order.end());
  std::vector<AnchorCell> cells;
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    const std::uint64_t key = order[begin].first;
    double x = 0, y = 0, w = 0;
    for (; end < order.size() && order[end].first == key; ++end) {
      const AnchorPoint& p = points[order[end].second];
      x += p.x, y += p.y, w += p.w;
    }
    const auto n = static_cast<double>(end - begin);
    if (n < min_points) continue;
    AnchorCell cell{static_cast<float>(x / n), static_cast<float>(y / n), w / n, 0, ColumnOf(key), RowOf(key)};
    cell.tolerance = tolerance.At(cell.x, cell.y, static_cast<float>(cell.w));
    cells.push_back(cell);
  }
  return cells;
}

}  // namespace phi
