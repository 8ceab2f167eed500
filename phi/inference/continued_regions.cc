#include "phi/inference/continued_regions.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <map>
#include <utility>

#include "phi/inference/spot.h"

namespace phi {
namespace {

constexpr int kMinAlike = 3;  // rows and columns: fewer are alike by chance

// Of the rows and columns that lead from one of two regions to the other.
struct Passages {
  int num_asked = 0, num_alike = 0;

  bool Continue() const { return num_alike >= kMinAlike && 2 * num_alike >= num_asked; }
};

class PassageCount {
 public:
  PassageCount(const Array2D<std::int32_t>& region, const Array2D<std::uint16_t>& brightness, int max_change, int reach)
      : region_(region), brightness_(brightness), max_change_(max_change), reach_(reach) {}

  // `length` pixels from `first` on, each `step` behind the one before; indices of the arrays' data.
  void AddLine(std::ptrdiff_t first, std::ptrdiff_t step, int length) {
    int last = -1;  // in a region
    for (int i = 0; i < length; ++i) {
      const std::int32_t own = region_.data()[first + i * step];
      if (own < 0) continue;
      if (last >= 0 && i + reach_ < length && last >= reach_) Add(first, step, last, i);
      last = i;
    }
  }

  const std::map<std::pair<std::int32_t, std::int32_t>, Passages>& passages() const { return passages_; }

 private:
  // The line leaves a region behind pixel `from`, and meets one at pixel `to`.
  void Add(std::ptrdiff_t first, std::ptrdiff_t step, int from, int to) {
    const auto region = [&](int i) { return region_.data()[first + i * step]; };
    const auto brightness = [&](int i) { return static_cast<int>(brightness_.data()[first + i * step]); };
    const std::int32_t a = region(from), b = region(to);
    const int within_a = from - reach_, within_b = to + reach_;
    if (a == b || region(within_a) != a || region(within_b) != b) return;
    Passages& passages = passages_[std::minmax(a, b)];
    ++passages.num_asked;
    if (std::abs(brightness(within_a) - brightness(within_b)) <= max_change_) ++passages.num_alike;
  }

  const Array2D<std::int32_t>& region_;
  const Array2D<std::uint16_t>& brightness_;
  const int max_change_, reach_;
  std::map<std::pair<std::int32_t, std::int32_t>, Passages> passages_;
};

}  // namespace

RegionLists FindContinuedRegions(const Array2D<std::int32_t>& region, std::int32_t num_regions, const Array2D<std::uint16_t>& brightness,
                                 int max_change, int reach) {
  const int width = region.width(), height = region.height(), side = SpotGrid(width, height).step;
  PassageCount count(region, brightness, max_change, reach);
  for (int y = side / 2; y < height; y += side) count.AddLine(static_cast<std::ptrdiff_t>(y) * width, 1, width);
  for (int x = side / 2; x < width; x += side) count.AddLine(x, width, height);
  RegionLists continued(static_cast<std::size_t>(num_regions));
  for (const auto& [regions, passages] : count.passages()) {
    if (!passages.Continue()) continue;
    continued[static_cast<std::size_t>(regions.first)].push_back(regions.second);
    continued[static_cast<std::size_t>(regions.second)].push_back(regions.first);
  }
  for (auto& list : continued) std::sort(list.begin(), list.end());
  return continued;
}

}  // namespace phi
