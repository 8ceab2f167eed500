#include "phi/inference/region_fit.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/median.h"
#include "phi/inference/fitted_planes.h"
#include "phi/inference/light_sources.h"
#include "phi/inference/plane_choice.h"
#include "phi/inference/region_anchors.h"
#include "phi/inference/shaded_surface.h"

namespace phi {
namespace {

// Of a plane that a region chooses: cells of its anchors on it, at least, their share, and what makes a cell. Single points
// are mostly what other views mistook on plain walls.
constexpr int kMinCells = 3, kMinCellPoints = 2;
constexpr double kMinCellShare = 0.05;
constexpr float kMoreAtCreases = 3;  // what a point there counts more than another
constexpr std::size_t kMinShadedSpots = 60;  // of a region whose shade is asked
constexpr double kAlignedWeight = 0.3;  // of standing along a direction of the scene, where a view's cells weigh 1
// Of a view whose regions chose the same plane, where a view's cells weigh 1: its choice rests on what many views measured.
constexpr double kAgreementWeight = 0.6;
constexpr double kMinUnlikeSky = 0.6;  // of the surface of the region's spots
constexpr double kMinForetold = 0.5;   // of what a plane foretells: most of it
constexpr double kFullReflected = 0.4;  // of the cells behind a mirror: the rest is mistaken, or was measured in no view

PlaneChoiceLimits ChoiceLimits(const RegionFitLimits& fit, float cell_side, const Rules& rules) {
  return {rules.Count(Rule::kScenePlanes, kMinCells), rules.Scale(Rule::kScenePlanes) * kMinCellShare, fit.min_apart,
          fit.reach_deviations, cell_side, rules.Factor(Rule::kSpotBrightness), rules.Factor(Rule::kSourceRegions),
          {rules.Factor(Rule::kSky) * kMinUnlikeSky, rules.Factor(Rule::kSky) * kMinForetold},
          rules.Factor(Rule::kMirrors) * kFullReflected, rules.Factor(Rule::kRightAngles) * kAlignedWeight,
          rules.Factor(Rule::kSecondChoice) * kAgreementWeight,
          rules.Factor(Rule::kContinuedRegions)};
}

// Of each region, by `index`.
std::vector<std::vector<Spot>> SpotsWithoutAnchor(const ImageRegions& regions, const std::vector<std::int32_t>& index, std::size_t size,
                                                  ArrayView2D<const float> anchors) {
  std::vector<std::vector<Spot>> spots(size);
  const SpotGrid grid(anchors.width, anchors.height);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Spot spot = grid.At(column, row);
      const std::int32_t region = regions.region(spot.x, spot.y);
      const std::int32_t k = region < 0 ? -1 : index[static_cast<std::size_t>(region)];
      if (k >= 0 && !(anchors(spot.x, spot.y) > 0)) spots[static_cast<std::size_t>(k)].push_back(spot);
    }
  }
  return spots;
}

// Where the search for the surface of a region that has no plane starts: everywhere as far as its middle anchor.
RegionPlane MiddleDepth(const std::vector<RegionPoint>& points) {
  std::vector<double> inverse_depths;
  for (const RegionPoint& p : points) inverse_depths.push_back(p.w);
  RegionPlane middle;
  middle.a = Median(&inverse_depths);
  return middle;
}

// Of a region that continues the one that takes them. They do not say how far that one reaches.
void AddContinuedCells(std::span<const AnchorCell> others, float weight, std::vector<AnchorCell>* cells) {
  for (AnchorCell cell : others) {
    cell.weight *= weight;
    cell.is_measured = false;
    cells->push_back(cell);
  }
}

// What is known of a region. cells_of(k): of the own anchors of region k of those fitted.
template <typename CellsOf>
RegionEvidence KnownOf(const FittedRegion& region, std::span<const Spot> spots, const PlaneEvidence& evidence, float continued_weight,
                       const CellsOf& cells_of) {
  std::vector<AnchorCell> cells = region.cells;
  for (const std::int32_t other : region.continued) AddContinuedCells(cells_of(other), continued_weight, &cells);
  return {std::move(cells), spots, evidence.views ? &*evidence.views : nullptr, evidence.sources,
          evidence.directions ? &*evidence.directions : nullptr, region.is_open};
}

void AddPlanes(std::span<const RegionPlane> planes, std::vector<ImagePlane>* candidates) {
  for (const RegionPlane& plane : planes) {
    if (plane.IsThere()) candidates->push_back(plane);
  }
}

// One image's.
class RegionFit {
 public:
  RegionFit(const ImageRegions& regions, ArrayView2D<const float> anchors, std::uint32_t image_id, const PlaneEvidence& evidence,
            const Rules& rules)
      : regions_(regions),
        image_id_(image_id),
        evidence_(evidence),
        rules_(rules),
        tolerance_(RegionTolerance(evidence.precision, rules)),
        limits_(rules),
        cell_side_(CellSide(anchors.width)),
        choice_(ChoiceLimits(limits_, cell_side_, rules)),
        anchors_(regions, anchors, evidence.pooled, MinAnchors(), evidence.states),
        own_(anchors_.size()),
        spots_(SpotsWithoutAnchor(regions, anchors_.index(), anchors_.size(), anchors)),
        shines_(anchors_.size()) {
    if (Views() == nullptr) return;
    const std::vector<bool> are_light_sources = FindLightSources(spots_, SpotGrid(anchors.width, anchors.height), *Views(), rules);
    // What has anchors over its greater part is a surface, and known: depths in the sky are those of what stands before it, at its rims.
    for (std::size_t k = 0; k < shines_.size(); ++k) shines_[k] = are_light_sources[k] && anchors_.IsOpen(k);
  }

  std::size_t size() const { return anchors_.size(); }
  const std::vector<std::int32_t>& index() const { return anchors_.index(); }

  // First, by what each region's own anchors say.
  void FitOwn(std::size_t k) {
    if (shines_[k]) return;
    Own& own = own_[k];
    own.points = anchors_.Points(k, tolerance_);
    own.planes = FitPlanes(limits_, own.points, Key(), static_cast<std::uint64_t>(anchors_.region(k)));
    own.cells = MakeAnchorCells(WeightedPoints(k), cell_side_, MinCellPoints(), tolerance_);
  }

  // Then by all that is known. All regions' own planes must be there.
  FittedRegion Fit(std::size_t k) const {
    if (shines_[k]) return Shining();
    FittedRegion fitted = Choose(k);
    if (!Chooses() || fitted.is_mirror) return fitted;  // a mirror's shade is of what it reflects
    if (const std::optional<RegionPlane> bent = SurfaceOf(k, fitted)) {
      fitted.planes = {*bent};
      fitted.sky = Sky::kNot;
      fitted.is_settled = true;
    }
    return fitted;
  }

 private:
  struct Own {
    std::vector<RegionPoint> points;
    std::vector<AnchorCell> cells;
    PlanesOfRegion planes{};
  };

  const Own& OwnOf(std::int32_t k) const { return own_[static_cast<std::size_t>(k)]; }
  // Whether regions take other planes than those through their own anchors.
  bool Chooses() const { return !evidence_.scene.empty() || !evidence_.sources.empty(); }
  int MinCellPoints() const { return rules_.Count(Rule::kScenePlanes, kMinCellPoints); }
  int MinAnchors() const { return Chooses() ? choice_.min_cells * MinCellPoints() : limits_.min_anchors; }
  const SpotViews* Views() const { return evidence_.views ? &*evidence_.views : nullptr; }
  RandomKey Key() const { return {0, image_id_}; }

  // Its points: those at creases weigh more.
  std::vector<AnchorPoint> WeightedPoints(std::size_t k) const {
    const Mask& creases = regions_.creases;
    const float crease_weight = 1 + rules_.Factor(Rule::kCreases) * kMoreAtCreases;
    std::vector<AnchorPoint> weighted;
    weighted.reserve(own_[k].points.size());
    for (const RegionPoint& p : own_[k].points) {
      const bool is_at_crease = !creases.empty() && creases(static_cast<int>(p.x + 0.5f), static_cast<int>(p.y + 0.5f)) != 0;
      weighted.push_back({p.x, p.y, p.w, p.is_measured, is_at_crease ? crease_weight : 1});
    }
    return weighted;
  }

  // Those that continue a region which has too few anchors to do without, by index into own_.
  std::vector<std::int32_t> Continued(std::size_t k) const {
    std::vector<std::int32_t> others;
    if (regions_.continued.empty() || !anchors_.IsOpen(k)) return others;
    for (const std::int32_t other : regions_.continued[static_cast<std::size_t>(anchors_.region(k))]) {
      if (const std::int32_t i = index()[static_cast<std::size_t>(other)]; i >= 0) others.push_back(i);
    }
    return others;
  }

  static FittedRegion Shining() {
    FittedRegion fitted;
    fitted.sky = Sky::kSeen;
    return fitted;
  }

  FittedRegion Choose(std::size_t k) const {
    FittedRegion fitted;
    fitted.planes = own_[k].planes;
    fitted.cells = own_[k].cells;
    fitted.continued = Continued(k);
    fitted.is_open = anchors_.IsOpen(k);
    if (!Chooses()) return fitted;
    RegionEvidence known = KnownOf(fitted, spots_[k], evidence_, choice_.continued_weight,
                                   [&](std::int32_t other) -> const std::vector<AnchorCell>& { return OwnOf(other).cells; });
    static_cast<ChosenPlanes&>(fitted) = ChoosePlanes(std::move(known), own_[k].planes, Candidates(k, fitted.continued), choice_);
    return fitted;
  }

  // Beside its own: the scene's, those of the regions that continue it, and what they carry together.
  std::vector<ImagePlane> Candidates(std::size_t k, std::span<const std::int32_t> others) const {
    std::vector<ImagePlane> candidates(evidence_.scene.begin(), evidence_.scene.end());
    for (const std::int32_t other : others) AddPlanes(OwnOf(other).planes, &candidates);
    if (!others.empty()) {
      AddPlanes(FitPlanes(limits_, PointsOfAll(k, others), Key(), static_cast<std::uint64_t>(anchors_.region(k))), &candidates);
    }
    return candidates;
  }

  // By ascending hash, as those of each region.
  std::vector<RegionPoint> PointsOfAll(std::size_t k, std::span<const std::int32_t> others) const {
    std::vector<RegionPoint> all;
    for (const std::int32_t other : others) all.insert(all.end(), OwnOf(other).points.begin(), OwnOf(other).points.end());
    all.insert(all.end(), own_[k].points.begin(), own_[k].points.end());
    std::stable_sort(all.begin(), all.end(), [](const RegionPoint& a, const RegionPoint& b) { return a.hash < b.hash; });
    return all;
  }

  // The bent surface that the views' brightness tells. A region with two planes is no one surface.
  std::optional<RegionPlane> SurfaceOf(std::size_t k, const FittedRegion& fitted) const {
    const bool is_asked = Views() != nullptr && rules_.IsOn(Rule::kShadedSurfaces) && spots_[k].size() >= kMinShadedSpots &&
                          !own_[k].points.empty() && !fitted.planes[1].IsThere();
    if (!is_asked) return std::nullopt;
    ShadeLimits limits;
    limits.min_change *= rules_.Factor(Rule::kShadedSurfaces);
    const RegionPlane start = fitted.planes[0].IsThere() ? fitted.planes[0] : MiddleDepth(own_[k].points);
    return SurfaceByShade(*Views(), spots_[k], own_[k].cells, start, limits_.reach_deviations, limits);
  }

  const ImageRegions& regions_;
  const std::uint32_t image_id_;
  const PlaneEvidence& evidence_;
  const Rules& rules_;
  const AnchorTolerance tolerance_;
  const RegionFitLimits limits_;
  const float cell_side_;
  const PlaneChoiceLimits choice_;
  const RegionAnchors anchors_;
  std::vector<Own> own_;
  std::vector<std::vector<Spot>> spots_;  // as own_: those without an anchor
  std::vector<bool> shines_;              // as own_
};

}  // namespace

FittedRegions FitRegions(const ImageRegions& regions, ArrayView2D<const float> anchors, std::uint32_t image_id,
                         const PlaneEvidence& evidence, const Rules& rules) {
  RegionFit fit(regions, anchors, image_id, evidence, rules);
  FittedRegions fitted = {std::vector<FittedRegion>(fit.size()), fit.index()};
  tbb::parallel_for(std::size_t{0}, fit.size(), [&](std::size_t k) { fit.FitOwn(k); });
  tbb::parallel_for(std::size_t{0}, fit.size(), [&](std::size_t k) { fitted.regions[k] = fit.Fit(k); });
  return fitted;
}

FittedRegions FitAgain(const ImageRegions& regions, ArrayView2D<const float> anchors, FittedRegions first,
                       const PlaneEvidence& evidence, const Rules& rules) {
  const PlaneChoiceLimits limits = ChoiceLimits(RegionFitLimits(rules), CellSide(anchors.width), rules);
  const auto cells_of = [&](std::int32_t k) -> const std::vector<AnchorCell>& { return first.regions[static_cast<std::size_t>(k)].cells; };
  const std::vector<std::vector<Spot>> spots = SpotsWithoutAnchor(regions, first.index, first.regions.size(), anchors);
  tbb::parallel_for(std::size_t{0}, first.regions.size(), [&](std::size_t k) {
    FittedRegion& region = first.regions[k];
    // A single view that takes a plane through the sky would otherwise give it to all.
    if (region.is_settled || region.sky != Sky::kNot) return;
    RegionEvidence known = KnownOf(region, spots[k], evidence, limits.continued_weight, cells_of);
    std::optional<ChosenPlanes> chosen = ChoosePlanesAgain(std::move(known), region, limits);
    if (chosen) static_cast<ChosenPlanes&>(region) = *std::move(chosen);
  });
  return first;
}

}  // namespace phi
