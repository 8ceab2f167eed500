#include "phi/inference/creases.h"

#include <algorithm>
#include <array>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

constexpr int kReachesAcross = 250, kLeastReach = 3;
constexpr std::array<std::array<int, 2>, 8> kDirections = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

// Sets `is_beside` where another region is beside.
PHI_WIDE_VECTORS void Compare(const std::int32_t* __restrict own, const std::int32_t* __restrict beside, int size,
                              std::int32_t* __restrict is_beside) {
  for (int x = 0; x < size; ++x) is_beside[x] |= static_cast<std::int32_t>((beside[x] >= 0) & (beside[x] != own[x]));
}

}  // namespace

Mask FindCreases(const Array2D<std::int32_t>& region) {
  const int width = region.width(), height = region.height(), reach = std::max(kLeastReach, width / kReachesAcross);
  Mask creases = Mask::Uninitialized(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    std::vector<std::int32_t> is_beside(static_cast<std::size_t>(width), 0);
    // Regions that meet at a sharp edge meet without a gap: two places a direction find all but the narrowest.
    for (const int distance : {reach, (reach + 1) / 2}) {
      for (const auto& [dx, dy] : kDirections) {
        const int u = dx * distance, v = y + dy * distance;
        const int begin = std::max(0, -u), end = std::min(width, width - u);
        if (v < 0 || v >= height || begin >= end) continue;
        Compare(&region(begin, y), &region(begin + u, v), end - begin, &is_beside[static_cast<std::size_t>(begin)]);
      }
    }
    std::transform(is_beside.begin(), is_beside.end(), &creases(0, y), [](std::int32_t is) -> std::uint8_t { return is != 0 ? 255 : 0; });
  });
  return creases;
}

}  // namespace phi
