#include "phi/inference/anchor_cells.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>

namespace phi {
namespace {

// Of an image's width, and pixels at least: a spot that windows of neighbouring pixels see in common.
constexpr float kCellsAcross = 128, kMinSide = 6;
// A factor of two in depth, so that a cell is a hundredth of its depth deep: a workspace in other units, if their ratio is a
// power of two, has the same cells.
constexpr int kCellsPerOctave = 70;

constexpr int kKeyBits = 20;
constexpr std::int64_t kKeyOffset = std::int64_t{1} << (kKeyBits - 1);

std::int64_t RoundedDown(double value) {
  const auto towards_zero = static_cast<std::int64_t>(value);
  return towards_zero - (static_cast<double>(towards_zero) > value ? 1 : 0);
}

std::uint64_t KeyPart(double cell) { return static_cast<std::uint64_t>(RoundedDown(cell) + kKeyOffset); }

constexpr int kFractionBits = 23;  // of a float
constexpr int kBinBits = 8;

// The floats of an octave whose fractions start with the same bits.
struct OctaveBin {
  std::int32_t cell;   // of the first ones, from the octave's upper end
  std::uint32_t next;  // the fraction from which on they lie in the next cell
};

std::array<OctaveBin, 1 << kBinBits> MakeOctaveBins() {
  const auto cell_of = [](std::uint32_t fraction) {
    const float mantissa = std::ldexp(static_cast<float>(fraction + (1u << kFractionBits)), -kFractionBits - 1);  // 0.5 to 1
    return static_cast<std::int32_t>(std::floor(kCellsPerOctave * std::log2(mantissa)));
  };
  std::array<OctaveBin, 1 << kBinBits> bins;
  for (std::uint32_t b = 0; b < bins.size(); ++b) {
    const std::uint32_t first = b << (kFractionBits - kBinBits);
    bins[b].cell = cell_of(first);
    std::uint32_t low = first, high = first + (1u << (kFractionBits - kBinBits));  // a bin is narrower than a cell
    while (high - low > 1) {
      const std::uint32_t middle = (low + high) / 2;
      (cell_of(middle) == bins[b].cell ? low : high) = middle;
    }
    bins[b].next = high;
  }
  return bins;
}

const std::array<OctaveBin, 1 << kBinBits> kOctaveBins = MakeOctaveBins();

// kCellsPerOctave times the logarithm to base 2, rounded down: a positive float has its octave in its upper bits.
std::int64_t DepthCell(float w) {
  const auto bits = std::bit_cast<std::uint32_t>(w);
  const std::uint32_t fraction = bits & ((1u << kFractionBits) - 1);
  const OctaveBin& bin = kOctaveBins[fraction >> (kFractionBits - kBinBits)];
  const int octave = static_cast<int>(bits >> kFractionBits) - 126;
  return kCellsPerOctave * octave + bin.cell + (fraction >= bin.next ? 1 : 0);
}

std::uint64_t KeyOf(const AnchorPoint& p, float side) {
  return KeyPart(p.x / side) << 2 * kKeyBits | KeyPart(p.y / side) << kKeyBits |
         static_cast<std::uint64_t>(DepthCell(p.w) + kKeyOffset);
}

int ColumnOf(std::uint64_t key) { return static_cast<int>(static_cast<std::int64_t>(key >> 2 * kKeyBits) - kKeyOffset); }
int RowOf(std::uint64_t key) {
  return static_cast<int>(static_cast<std::int64_t>(key >> kKeyBits & ((1u << kKeyBits) - 1)) - kKeyOffset);
}

// A point's cell, and its place in the list.
using KeyedPoint = std::pair<std::uint64_t, std::uint32_t>;

// By column and row, then place in the list. Depths may be in any order.
void SortByPlace(std::vector<KeyedPoint>* points) {
  if (points->empty()) return;
  int first_column = ColumnOf(points->front().first), last_column = first_column;
  int first_row = RowOf(points->front().first), last_row = first_row;
  for (const auto& [key, place] : *points) {
    first_column = std::min(first_column, ColumnOf(key)), last_column = std::max(last_column, ColumnOf(key));
    first_row = std::min(first_row, RowOf(key)), last_row = std::max(last_row, RowOf(key));
  }
  const std::int64_t num_rows = std::int64_t{last_row} - first_row + 1;
  const std::int64_t num_buckets = (std::int64_t{last_column} - first_column + 1) * num_rows;
  constexpr std::int64_t kMaxBucketsPerPoint = 16;
  if (num_buckets > kMaxBucketsPerPoint * std::ssize(*points)) {
    std::sort(points->begin(), points->end());
    return;
  }
  const auto bucket = [&](std::uint64_t key) {
    return static_cast<std::size_t>((ColumnOf(key) - first_column) * num_rows + RowOf(key) - first_row);
  };
  std::vector<std::uint32_t> next(static_cast<std::size_t>(num_buckets) + 1, 0);  // place for a bucket's next point
  for (const auto& [key, place] : *points) ++next[bucket(key) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<KeyedPoint> sorted(points->size());
  for (const KeyedPoint& point : *points) sorted[next[bucket(point.first)]++] = point;
  points->swap(sorted);
}

// Of a cell's points.
struct CellSum {
  std::uint64_t key;
  int count = 0;
  double x = 0, y = 0, w = 0, weight = 0;
  bool is_measured = false;

  void Add(const AnchorPoint& p) {
    ++count;
    x += p.x, y += p.y, w += p.w, weight += p.weight;
    is_measured |= p.is_measured;
  }
  AnchorCell Cell(const AnchorTolerance& tolerance) const {
    const auto n = static_cast<double>(count);
    AnchorCell cell{static_cast<float>(x / n), static_cast<float>(y / n), w / n, 0, ColumnOf(key), RowOf(key), is_measured,
                    static_cast<float>(weight / n)};
    cell.tolerance = tolerance.At(cell.x, cell.y, static_cast<float>(cell.w));
    return cell;
  }
};

// The sum of that key; a new one where there is none. The points of one place mostly have a few depths, one after the other.
CellSum* SumWith(std::uint64_t key, std::vector<CellSum>* sums) {
  for (std::size_t i = sums->size(); i-- > 0;) {
    if ((*sums)[i].key == key) return &(*sums)[i];
  }
  return &sums->emplace_back(CellSum{key});
}

}  // namespace

float AnchorTolerance::At(float x, float y, float w) const {
  return Of(precision.RelativeDeviation(x + 0.5f, y + 0.5f, 1 / w), w);
}

float CellSide(int image_width) { return std::max(kMinSide, static_cast<float>(image_width) / kCellsAcross); }

std::vector<AnchorCell> MakeAnchorCells(const std::vector<AnchorPoint>& points, float side, int min_points,
                                        const AnchorTolerance& tolerance) {
  std::vector<KeyedPoint> order;
  order.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Another program's map may hold a depth whose inverse is beyond numbers.
    if (std::isnormal(points[i].w)) order.emplace_back(KeyOf(points[i], side), static_cast<std::uint32_t>(i));
  }
  SortByPlace(&order);
  std::vector<AnchorCell> cells;
  std::vector<CellSum> sums;
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    const std::uint64_t place = order[begin].first >> kKeyBits;
    sums.clear();
    for (; end < order.size() && order[end].first >> kKeyBits == place; ++end) {
      SumWith(order[end].first, &sums)->Add(points[order[end].second]);
    }
    std::sort(sums.begin(), sums.end(), [](const CellSum& a, const CellSum& b) { return a.key < b.key; });
    for (const CellSum& sum : sums) {
      if (sum.count >= min_points) cells.push_back(sum.Cell(tolerance));
    }
  }
  return cells;
}

}  // namespace phi
