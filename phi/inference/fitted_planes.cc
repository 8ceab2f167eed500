#include "phi/inference/fitted_planes.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "phi/inference/scored_anchors.h"
#include "phi/inference/second_surface.h"

namespace phi {
namespace {

constexpr int kMinAnchors = 60, kMaxDraws = 100;
constexpr double kMinShare = 0.15, kMinApart = 0.02, kMinSpread = 3;
constexpr double kMinTriangle = 100;      // twice the area of a draw's, square pixels
constexpr double kConfidence = 0.9999;    // that one of the draws hit inliers only; no more are made then
constexpr std::size_t kMaxScored = 1500;  // anchors that a draw is scored on
// Standard deviations of the inliers' places: so far from their mean, the fitted depth is about five times as uncertain.
constexpr double kReachDeviations = 5;

// Least squares over the inliers; false when they do not carry a plane. Sets the ellipse.
bool Refine(const RegionFitLimits& limits, const std::vector<RegionPoint>& points, RegionPlane* plane) {
  PlaneFit fit(points[0].x, points[0].y);
  for (const RegionPoint& p : points) {
    if (IsOn(*plane, p)) fit.Add(p);
  }
  if (fit.count() < limits.min_anchors) return false;
  if (!(fit.NarrowVariance() > limits.min_spread * limits.min_spread)) return false;
  fit.Solve(plane);
  plane->SetReach(fit.Mean(), fit.Covariance(), limits.reach_deviations);
  return true;
}

// Draws after which one of them is likely to have hit inliers only.
int NumDraws(double inlier_share, int most) {
  const double hit = inlier_share * inlier_share * inlier_share;
  if (hit >= 1) return 1;
  const double draws = std::log(1 - kConfidence) / std::log1p(-hit);
  return draws < most ? static_cast<int>(std::ceil(draws)) : most;
}

// The point whose hash is the next from `word` on. Points by ascending hash, which is uniform: it lies near where it would be if
// they were evenly spaced.
const RegionPoint& PointAt(const std::vector<RegionPoint>& points, std::uint32_t word) {
  std::size_t next = static_cast<std::size_t>(std::uint64_t{word} * points.size() >> 32);
  while (next > 0 && points[next - 1].hash >= word) --next;
  while (next < points.size() && points[next].hash < word) ++next;
  return next == points.size() ? points.front() : points[next];
}

// The plane that most of the points agree on. Points by ascending hash: the first ones are a sample of them all.
bool FitPlane(const RegionFitLimits& limits, const std::vector<RegionPoint>& points, RandomKey key, std::uint64_t region,
              std::uint32_t round, RegionPlane* best) {
  const ScoredAnchors scored(std::span<const RegionPoint>(points).first(std::min(points.size(), kMaxScored)));
  std::size_t best_count = 0;
  int num_draws = limits.max_draws;
  for (int draw = 0; draw < num_draws; ++draw) {
    const Random4 random = Philox(key, region, round, static_cast<std::uint32_t>(draw));
    RegionPlane plane;
    if (!PlaneThrough(PointAt(points, random.v[0]), PointAt(points, random.v[1]),
                      PointAt(points, random.v[2]), kMinTriangle, &plane)) {
      continue;
    }
    const std::size_t count = scored.CountInliers(plane, best_count);
    if (count <= best_count) continue;
    best_count = count;
    *best = plane;
    num_draws = NumDraws(static_cast<double>(count) / static_cast<double>(scored.size()), limits.max_draws);
  }
  if (static_cast<double>(best_count) < limits.min_share * static_cast<double>(scored.size())) return false;
  return Refine(limits, points, best) && Refine(limits, points, best);
}

}  // namespace

RegionFitLimits::RegionFitLimits(const Rules& rules)
    : min_anchors(rules.Count(Rule::kRegionPlanes, kMinAnchors)), max_draws(rules.Count(Rule::kRegionPlanes, kMaxDraws)) {
  const float scale = rules.Scale(Rule::kRegionPlanes);
  min_share = scale * kMinShare;
  min_apart = scale * kMinApart;
  min_spread = scale * kMinSpread;
  reach_deviations = scale * kReachDeviations;
}

PlanesOfRegion FitPlanes(const RegionFitLimits& limits, std::vector<RegionPoint> points, RandomKey key, std::uint64_t region) {
  PlanesOfRegion planes{};
  for (int k = 0; k < kPlanesPerRegion && std::ssize(points) >= limits.min_anchors; ++k) {
    RegionPlane plane;
    if (!FitPlane(limits, points, key, region, static_cast<std::uint32_t>(k), &plane)) break;
    if (k > 0 && IsNoSecondSurface(points, planes[0], plane, limits.min_apart)) break;
    planes[k] = plane;
    std::erase_if(points, [&](const RegionPoint& p) { return IsOn(plane, p); });
  }
  return planes;
}

}  // namespace phi
