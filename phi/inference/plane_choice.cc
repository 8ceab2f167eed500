#include "phi/inference/plane_choice.h"

#include <algorithm>
#include <cstddef>

#include "phi/inference/second_surface.h"

namespace phi {
namespace {

// Without cells on it a plane of the scene has no reach, until it is chosen.
std::vector<RegionPlane> Candidates(const std::array<RegionPlane, kPlanesPerRegion>& own, std::span<const ImagePlane> scene) {
  std::vector<RegionPlane> candidates;
  for (const RegionPlane& plane : own) {
    if (plane.IsThere()) candidates.push_back(plane);
  }
  for (const ImagePlane& plane : scene) candidates.push_back({plane});
  return candidates;
}

double ScoreOf(const ImagePlane& plane, const std::vector<AnchorCell>& cells, double min_apart, double* num_on) {
  double score = 0;
  *num_on = 0;
  for (const AnchorCell& cell : cells) {
    if (IsOn(plane, cell)) {
      const double off = cell.Off(plane);
      ++*num_on;
      score += 1 - off * off;
    } else if (cell.w < (1 - min_apart) * plane.InverseDepth(cell.x, cell.y)) {
      score -= 1;
    }
  }
  return score;
}

// Around the cells on it, of which there are some.
void SetReach(const std::vector<AnchorCell>& cells, const PlaneChoiceLimits& limits, RegionPlane* plane) {
  PlaneFit places(cells[0].x, cells[0].y);
  for (const AnchorCell& cell : cells) {
    if (IsOn(*plane, cell)) places.Add(cell);
  }
  const Eigen::Matrix2d own_size = limits.min_deviation * limits.min_deviation * Eigen::Matrix2d::Identity();
  plane->SetReach(places.Mean(), places.Covariance() + own_size, limits.reach_deviations);
}

}  // namespace

std::array<RegionPlane, kPlanesPerRegion> ChoosePlanes(std::vector<AnchorCell> cells,
                                                       const std::array<RegionPlane, kPlanesPerRegion>& own,
                                                       std::span<const ImagePlane> scene, const PlaneChoiceLimits& limits) {
  const std::vector<RegionPlane> candidates = Candidates(own, scene);
  const double enough = std::max<double>(limits.min_cells, limits.min_share * static_cast<double>(cells.size()));
  std::array<RegionPlane, kPlanesPerRegion> chosen{};
  for (int k = 0; k < kPlanesPerRegion; ++k) {
    const RegionPlane* best = nullptr;
    double best_score = 0;
    for (const RegionPlane& candidate : candidates) {
      double num_on;
      const double score = ScoreOf(candidate, cells, limits.min_apart, &num_on);
      if (num_on < enough || (best != nullptr && score <= best_score)) continue;
      best = &candidate;
      best_score = score;
    }
    if (best == nullptr || (k > 0 && IsNoSecondSurface(cells, chosen[0], *best, limits.min_apart))) break;
    chosen[k] = *best;
    if (!best->IsThere()) SetReach(cells, limits, &chosen[k]);
    std::erase_if(cells, [&](const AnchorCell& cell) { return IsOn(chosen[k], cell); });
  }
  return chosen;
}

}  // namespace phi
