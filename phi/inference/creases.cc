#include "phi/inference/creases.h"

#include <algorithm>
#include <array>

namespace phi {
namespace {

constexpr int kReachesAcross = 250, kLeastReach = 3;
constexpr std::array<std::array<int, 2>, 8> kDirections = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

}  // namespace

bool IsAtCrease(const ImageRegions& regions, std::int32_t own, int x, int y) {
  const Array2D<std::int32_t>& region = regions.region;
  const int reach = std::max(kLeastReach, region.width() / kReachesAcross);
  // Regions that meet at a sharp edge meet without a gap: two places a direction find all but the narrowest.
  for (const int distance : {reach, (reach + 1) / 2}) {
    for (const auto& [dx, dy] : kDirections) {
      const int u = x + dx * distance, v = y + dy * distance;
      if (u < 0 || v < 0 || u >= region.width() || v >= region.height()) continue;
      if (region(u, v) >= 0 && region(u, v) != own) return true;
    }
  }
  return false;
}

}  // namespace phi
