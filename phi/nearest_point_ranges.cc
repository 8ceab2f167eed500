#include "phi/nearest_point_ranges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

// Points in square bins, so that a search looks at the near ones only.
class PointBins {
 public:
  PointBins(const std::vector<SparseObservation>& points, int width, int height, float bin_size)
      : bin_size_(bin_size),
        columns_(static_cast<int>(std::ceil(width / bin_size))),
        rows_(static_cast<int>(std::ceil(height / bin_size))),
        first_(static_cast<std::size_t>(columns_) * rows_ + 1, 0) {
    for (const SparseObservation& point : points) ++first_[BinOf(point) + 1];
    for (std::size_t bin = 1; bin < first_.size(); ++bin) first_[bin] += first_[bin - 1];
    points_.resize(points.size());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const SparseObservation& point : points) points_[next[BinOf(point)]++] = point;
  }

  int Column(float u) const { return std::clamp(static_cast<int>(u / bin_size_), 0, columns_ - 1); }
  int Row(float v) const { return std::clamp(static_cast<int>(v / bin_size_), 0, rows_ - 1); }

  // Calls visit(point) for the bins at Chebyshev distance `ring` of bin (column, row).
  template <typename Visit>
  void VisitRing(int column, int row, int ring, const Visit& visit) const {
    for (int r = std::max(row - ring, 0); r <= std::min(row + ring, rows_ - 1); ++r) {
      const bool whole_row = std::abs(r - row) == ring;
      const int step = whole_row || ring == 0 ? 1 : 2 * ring;
      for (int c = column - ring; c <= column + ring; c += step) {
        if (c < 0 || c >= columns_) continue;
        const std::size_t bin = static_cast<std::size_t>(r) * columns_ + c;
        for (std::size_t i = first_[bin]; i < first_[bin + 1]; ++i) visit(points_[i]);
      }
    }
  }

 private:
  std::size_t BinOf(const SparseObservation& point) const {
    return static_cast<std::size_t>(Row(point.v)) * columns_ + Column(point.u);
  }

  float bin_size_;  // pixels
  int columns_, rows_;
  std::vector<std::size_t> first_;
  std::vector<SparseObservation> points_;
};

struct Nearest {
  float squared_distance = std::numeric_limits<float>::infinity();
  float depth = 0;
};

DepthRange RangeOf(const std::array<Nearest, 4>& nearest) {
  DepthRange range{std::numeric_limits<float>::infinity(), 0};
  int count = 0;
  for (const Nearest& n : nearest) {
    if (n.depth <= 0) continue;
    ++count;
    range.min = std::min(range.min, n.depth);
    range.max = std::max(range.max, n.depth);
  }
  return count >= 2 ? range : DepthRange{};
}

DepthRange RangeAt(const PointBins& bins, float u, float v, float bin_size, float radius) {
  std::array<Nearest, 4> nearest;
  const int column = bins.Column(u), row = bins.Row(v);
  const float squared_radius = radius * radius;
  const auto visit = [&](const SparseObservation& point) {
    const float du = point.u - u, dv = point.v - v;
    const float squared_distance = du * du + dv * dv;
    if (squared_distance >= squared_radius) return;
    Nearest& n = nearest[(du >= 0 ? 1 : 0) + (dv >= 0 ? 2 : 0)];
    const bool nearer = squared_distance < n.squared_distance ||
                        (squared_distance == n.squared_distance && point.depth < n.depth);
    if (nearer) n = {squared_distance, point.depth};
  };
  for (int ring = 0; (ring - 1) * bin_size < radius; ++ring) {
    const float reached =
        static_cast<float>(std::max(ring - 1, 0)) * bin_size;  // rings beyond are farther than this
    const bool done = std::all_of(nearest.begin(), nearest.end(),
                                  [&](const Nearest& n) { return n.squared_distance < reached * reached; });
    if (done) break;
    bins.VisitRing(column, row, ring, visit);
  }
  return RangeOf(nearest);
}

}  // namespace

DepthRangeMap NearestPointDepthRanges(const std::vector<SparseObservation>& points, int width, int height) {
  const float radius = static_cast<float>(width) / 10;
  const float bin_size = std::max(radius / 8, 4.0f);
  const PointBins bins(points, width, height, bin_size);
  const auto cells = [](int size) { return (size + kDepthRangeCell - 1) / kDepthRangeCell; };
  DepthRangeMap map(cells(width), cells(height));
  tbb::parallel_for(0, map.height(), [&](int row) {
    for (int column = 0; column < map.width(); ++column) {
      const float u = (static_cast<float>(column) + 0.5f) * kDepthRangeCell;
      const float v = (static_cast<float>(row) + 0.5f) * kDepthRangeCell;
      map(column, row) = RangeAt(bins, u, v, bin_size, radius);
    }
  });
  return map;
}

}  // namespace phi
