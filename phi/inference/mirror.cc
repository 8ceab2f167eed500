#include "phi/inference/mirror.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "phi/inference/convex_hull.h"

namespace phi {
namespace {

constexpr double kMinFramed = 0.9;  // of the spots: between cells on the plane
// Of the cells behind: where so many lie clearly behind, the others are what is reflected near the mirror's foot.
constexpr double kMinClear = 0.5;
constexpr std::size_t kMaxAsked = 256;  // of the cells behind; of more, evenly drawn ones

bool IsFramed(std::vector<Place> on, std::span<const Spot> spots) {
  const ConvexHull hull(std::move(on));
  const auto num_inside = std::count_if(spots.begin(), spots.end(), [&](const Spot& spot) {
    return hull.Contains({static_cast<double>(spot.x), static_cast<double>(spot.y)});
  });
  return static_cast<double>(num_inside) >= kMinFramed * static_cast<double>(spots.size());
}

std::vector<AnchorCell> Drawn(const std::vector<AnchorCell>& cells) {
  const std::size_t size = std::min(cells.size(), kMaxAsked);
  std::vector<AnchorCell> drawn;
  for (std::size_t i = 0; i < size; ++i) drawn.push_back(cells[i * cells.size() / size]);
  return drawn;
}

}  // namespace

double ReflectedShare(PlaneSides sides, std::span<const Spot> spots, const ImagePlane& plane, double full_share, const SpotViews& views) {
  const auto num_behind = static_cast<double>(sides.num_behind), num_clearly = static_cast<double>(sides.clearly_behind.size());
  if (sides.clearly_behind.size() < kFewTold || !IsFramed(std::move(sides.on), spots)) return 0;
  const SpotViews::Mirrored mirrored = views.CountMirrored(Drawn(sides.clearly_behind), plane);
  const std::size_t num_told = mirrored.num_measured + mirrored.num_seen_past;
  if (num_told < kFewTold) return 0;
  const double more_than_chance = static_cast<double>(mirrored.num_measured) - mirrored.num_by_chance;
  const double share = std::clamp(more_than_chance / (full_share * static_cast<double>(num_told)), 0.0, 1.0);
  return share * std::min(1.0, num_clearly / (kMinClear * num_behind));
}

}  // namespace phi
