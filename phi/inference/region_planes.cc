#include "phi/inference/region_planes.h"

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/image_mask.h"
#include "phi/base/median.h"
#include "phi/base/whole_array.h"
#include "phi/inference/creases.h"
#include "phi/inference/fitted_planes.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/infer_pixel.h"
#include "phi/inference/light_sources.h"
#include "phi/inference/region_anchors.h"
#include "phi/inference/shaded_surface.h"

namespace phi {
namespace {

// Of an inlier, relative inverse depth: the greater of a share and of standard deviations of what matching can tell.
constexpr float kTolerance = 0.003f, kToleranceDeviations = 3;
// Of a plane that a region chooses: cells of its anchors on it, at least, their share, and what makes a cell. Single points
// are mostly what other views mistook on plain walls.
constexpr int kMinCells = 3, kMinCellPoints = 2;
constexpr double kMinCellShare = 0.05;
constexpr float kMoreAtCreases = 3;  // what a point there counts more than another
constexpr std::size_t kMinShadedSpots = 60;  // of a region whose shade is asked
constexpr double kAlignedWeight = 0.3;  // of standing along a direction of the scene, where a view's cells weigh 1
constexpr double kMinUnlikeSky = 0.6;  // of the surface of the region's spots
constexpr double kMinForetold = 0.5;   // of what a plane foretells: most of it
constexpr double kFullReflected = 0.4;  // of the cells behind a mirror: the rest is mistaken, or was measured in no view

AnchorTolerance ToleranceOf(const DepthPrecision& precision, const Rules& rules) {
  const float scale = rules.Scale(Rule::kRegionPlanes);
  return {scale * kTolerance, scale * kToleranceDeviations, precision};
}

PlaneChoiceLimits ChoiceLimits(const RegionFitLimits& fit, float cell_side, const Rules& rules) {
  return {rules.Count(Rule::kScenePlanes, kMinCells), rules.Scale(Rule::kScenePlanes) * kMinCellShare, fit.min_apart,
          fit.reach_deviations, cell_side, rules.Factor(Rule::kSpotBrightness), rules.Factor(Rule::kSourceRegions),
          rules.Factor(Rule::kSky) * kMinUnlikeSky, rules.Factor(Rule::kSky) * kMinForetold, rules.Factor(Rule::kMirrors) * kFullReflected,
          rules.Factor(Rule::kRightAngles) * kAlignedWeight};
}

// Points at creases weigh so much.
std::vector<AnchorPoint> WeightedPoints(const std::vector<RegionPoint>& points, const ImageRegions& regions, std::int32_t region,
                                        float crease_weight) {
  std::vector<AnchorPoint> weighted;
  weighted.reserve(points.size());
  for (const RegionPoint& p : points) {
    const bool is_at_crease =
        crease_weight != 1 && IsAtCrease(regions, region, static_cast<int>(p.x + 0.5f), static_cast<int>(p.y + 0.5f));
    weighted.push_back({p.x, p.y, p.w, p.is_measured, is_at_crease ? crease_weight : 1});
  }
  return weighted;
}

// Where the search for the surface of a region that has no plane starts: everywhere as far as its middle anchor.
RegionPlane MiddleDepth(const std::vector<RegionPoint>& points) {
  std::vector<double> inverse_depths;
  for (const RegionPoint& p : points) inverse_depths.push_back(p.w);
  RegionPlane middle;
  middle.a = Median(&inverse_depths);
  return middle;
}

// What is known of a region.
struct FoundRegion {
  const std::array<RegionPlane, kPlanesPerRegion>& planes;
  const std::vector<RegionPoint>& points;
  const std::vector<AnchorCell>& cells;
  const std::vector<Spot>& spots;  // without an anchor
};

// A region with two planes is no one surface.
std::optional<RegionPlane> SurfaceOf(const FoundRegion& region, const SpotViews* views, double reach_deviations, const Rules& rules) {
  const bool is_asked = views != nullptr && rules.IsOn(Rule::kShadedSurfaces) && region.spots.size() >= kMinShadedSpots &&
                        !region.points.empty() && !region.planes[1].IsThere();
  if (!is_asked) return std::nullopt;
  ShadeLimits limits;
  limits.min_change *= rules.Factor(Rule::kShadedSurfaces);
  const RegionPlane start = region.planes[0].IsThere() ? region.planes[0] : MiddleDepth(region.points);
  return SurfaceByShade(*views, region.spots, region.cells, start, reach_deviations, limits);
}

RandomKey KeyOf(std::uint32_t image_id) { return {0, image_id}; }

// Of a region that continues the one that takes them. They do not say how far that one reaches.
void AddCells(std::span<const AnchorCell> others, float weight, std::vector<AnchorCell>* cells) {
  for (AnchorCell cell : others) {
    cell.weight *= weight;
    cell.is_measured = false;
    cells->push_back(cell);
  }
}

void AddPlanes(std::span<const RegionPlane> planes, std::vector<ImagePlane>* candidates) {
  for (const RegionPlane& plane : planes) {
    if (plane.IsThere()) candidates->push_back(plane);
  }
}

// By ascending hash, as those of each region.
std::vector<RegionPoint> PointsOfAll(const std::vector<std::vector<RegionPoint>>& points, std::span<const std::size_t> others,
                                     std::size_t own) {
  std::vector<RegionPoint> all;
  for (const std::size_t other : others) all.insert(all.end(), points[other].begin(), points[other].end());
  all.insert(all.end(), points[own].begin(), points[own].end());
  std::stable_sort(all.begin(), all.end(), [](const RegionPoint& a, const RegionPoint& b) { return a.hash < b.hash; });
  return all;
}

// Of the reference view, as the sources that it was matched with tell it.
DepthPrecision PrecisionOf(const InferenceInput& input) {
  std::vector<const Camera*> sources;
  for (std::size_t j = 0; j < input.NumMatched(); ++j) sources.push_back(&input.sources[j].view->camera);
  return {input.reference.view->camera, sources};
}

std::uint8_t LimitOf(Sky sky) {
  switch (sky) {
    case Sky::kNot: return 0;
    case Sky::kMayBe: return kMeasuredOnly;
    case Sky::kSeen: return kMeasuredOnly | kNoLine;
  }
  return 0;
}

std::vector<SourceRegions> RegionsOfSources(const InferenceInput& input, const Rules& rules) {
  std::vector<SourceRegions> sources;
  if (!rules.IsOn(Rule::kSourceRegions)) return sources;
  for (std::size_t j = 0; j < input.source_regions.size(); ++j) {
    if (input.source_regions[j] == nullptr) continue;
    sources.emplace_back(input.source_regions[j], input.sources[j].view->camera, input.reference.view->camera);
  }
  return sources;
}

}  // namespace

PlaneEvidence GatherPlaneEvidence(const InferenceInput& input, const Rules& rules) {
  PlaneEvidence evidence;
  std::vector<RelativeExposure> exposures;
  evidence.pooled = PoolAnchors(input, rules, &exposures);
  evidence.precision = PrecisionOf(input);
  evidence.states = input.measured->states.view();
  evidence.views.emplace(input, exposures);
  evidence.sources = RegionsOfSources(input, rules);
  const std::vector<CarriedPlane> scene = FindScenePlanes(input, ToleranceOf(evidence.precision, rules), rules);
  evidence.scene.assign(scene.begin(), scene.end());
  if (rules.IsOn(Rule::kRightAngles)) evidence.directions = FindDirections(scene, input.reference.view->camera.pinhole);
  return evidence;
}

ViewRegions FindViewRegions(std::shared_ptr<const ImageRegions> regions, const MeasuredDepths& depths, std::uint32_t image_id,
                            const DepthPrecision& precision, const Rules& rules) {
  auto anchors = Array2D<float>::Uninitialized(depths.width(), depths.height());
  tbb::parallel_for(0, depths.height(), [&](int y) {
    for (int x = 0; x < depths.width(); ++x) {
      anchors(x, y) = AnchorAt(depths.states(x, y), depths.depths(x, y), Formulas::kRobust);
    }
  });
  PlaneEvidence own;
  own.precision = precision;
  own.states = depths.states.view();
  return RegionPlanes(std::move(regions), std::as_const(anchors).view(), image_id, own, rules).Tell();
}

std::shared_ptr<const GrayImage> RegionImage(const InferenceInput& input) {
  if (input.mask == nullptr) return input.reference.image;
  return std::make_shared<const GrayImage>(CutOutMask(*input.reference.image, *input.mask));
}

std::shared_ptr<const ImageRegions> RegionsOf(const InferenceInput& input, const Rules& rules) {
  if (input.regions != nullptr) return input.regions;
  return std::make_shared<const ImageRegions>(FindRegions(*RegionImage(input), rules));
}

RegionPlanes::RegionPlanes(std::shared_ptr<const ImageRegions> regions, ArrayView2D<const float> anchors,
                           std::uint32_t image_id, const PlaneEvidence& evidence, const Rules& rules)
    : tolerance_(ToleranceOf(evidence.precision, rules)), regions_(std::move(regions)) {
  const RegionFitLimits limits(rules);
  const float side = CellSide(anchors.width);
  const PlaneChoiceLimits choice = ChoiceLimits(limits, side, rules);
  const int min_cell_points = rules.Count(Rule::kScenePlanes, kMinCellPoints);
  const float crease_weight = 1 + rules.Factor(Rule::kCreases) * kMoreAtCreases;
  const bool chooses = !evidence.scene.empty() || !evidence.sources.empty();
  const int min_anchors = chooses ? choice.min_cells * min_cell_points : limits.min_anchors;
  const RegionAnchors own(*regions_, anchors, evidence.pooled, min_anchors, evidence.states);
  index_ = own.index();
  planes_.resize(own.size());
  sky_.resize(own.size(), Sky::kNot);
  are_mirrors_.resize(own.size(), 0);
  cells_.resize(own.size());
  const std::vector<std::vector<Spot>> spots = SpotsWithoutAnchor(anchors);
  const SpotViews* views = evidence.views ? &*evidence.views : nullptr;
  std::vector<bool> are_light_sources(own.size());
  if (views != nullptr) are_light_sources = FindLightSources(spots, SpotGrid(anchors.width, anchors.height), *views, rules);
  // What has anchors over its greater part is a surface, and known: depths in the sky are those of what stands before it, at its rims.
  const auto shines = [&](std::size_t k) { return are_light_sources[k] && own.IsOpen(k); };
  std::vector<std::vector<RegionPoint>> points(own.size());
  tbb::parallel_for(std::size_t{0}, own.size(), [&](std::size_t k) {
    if (shines(k)) return;
    points[k] = own.Points(k, tolerance_);
    planes_[k] = FitPlanes(limits, points[k], KeyOf(image_id), static_cast<std::uint64_t>(own.region(k)));
    cells_[k] = MakeAnchorCells(WeightedPoints(points[k], *regions_, own.region(k), crease_weight), side, min_cell_points, tolerance_);
  });
  // In their place, what they and the regions that continue them tell together.
  const std::vector<std::vector<AnchorCell>> own_cells = cells_;
  const std::vector<std::array<RegionPlane, kPlanesPerRegion>> own_planes = planes_;
  const SceneDirections* directions = evidence.directions ? &*evidence.directions : nullptr;
  tbb::parallel_for(std::size_t{0}, own.size(), [&](std::size_t k) {
    if (shines(k)) {
      sky_[k] = Sky::kSeen;
      return;
    }
    const std::vector<std::size_t> others = own.IsOpen(k) ? Continued(own.region(k)) : std::vector<std::size_t>();
    for (const std::size_t other : others) AddCells(own_cells[other], rules.Factor(Rule::kContinuedRegions), &cells_[k]);
    if (!chooses) return;
    std::vector<ImagePlane> candidates(evidence.scene.begin(), evidence.scene.end());
    for (const std::size_t other : others) AddPlanes(own_planes[other], &candidates);
    if (!others.empty()) {
      const std::vector<RegionPoint> all_points = PointsOfAll(points, others, k);
      AddPlanes(FitPlanes(limits, all_points, KeyOf(image_id), static_cast<std::uint64_t>(own.region(k))), &candidates);
    }
    RegionEvidence known = {cells_[k], spots[k], views, evidence.sources, directions, own.IsOpen(k)};
    const ChosenPlanes chosen = ChoosePlanes(std::move(known), planes_[k], candidates, choice);
    planes_[k] = chosen.planes;
    sky_[k] = chosen.sky;
    are_mirrors_[k] = chosen.is_mirror;
    if (chosen.is_mirror) return;  // its shade is of what it reflects
    if (const auto bent = SurfaceOf({planes_[k], points[k], own_cells[k], spots[k]}, views, limits.reach_deviations, rules)) {
      planes_[k] = {*bent};
      sky_[k] = Sky::kNot;
    }
  });
}

std::vector<std::size_t> RegionPlanes::Continued(std::int32_t region) const {
  std::vector<std::size_t> others;
  if (regions_->continued.empty()) return others;
  for (const std::int32_t other : regions_->continued[static_cast<std::size_t>(region)]) {
    if (const std::int32_t k = index_[static_cast<std::size_t>(other)]; k >= 0) others.push_back(static_cast<std::size_t>(k));
  }
  return others;
}

bool RegionPlanes::ShowsSky() const { return std::find(sky_.begin(), sky_.end(), Sky::kSeen) != sky_.end(); }

Mask RegionPlanes::LineLimits(ArrayView2D<const float> anchors, const Rules& rules) const {
  const std::uint8_t even = rules.IsOn(Rule::kEvenLines) ? kBetweenSidesOnly : 0;
  const double min_apart = RegionFitLimits(rules).min_apart;
  auto limits = Mask::Uninitialized(anchors.width, anchors.height);
  tbb::parallel_for(0, anchors.height, [&](int y) {
    for (int x = 0; x < anchors.width; ++x) {
      const std::int32_t own = IndexAt(x, y);
      limits(x, y) = regions_->region(x, y) < 0 ? 0 : even;
      if (own < 0) continue;
      const auto k = static_cast<std::size_t>(own);
      limits(x, y) |= LimitOf(sky_[k]);
      const AnchorPoint anchor = {static_cast<float>(x), static_cast<float>(y), anchors(x, y)};
      if (are_mirrors_[k] != 0 && anchor.w > 0 && IsBehind(planes_[k][0], anchor, min_apart)) limits(x, y) |= kReflected;
    }
  });
  return limits;
}

std::vector<std::vector<Spot>> RegionPlanes::SpotsWithoutAnchor(ArrayView2D<const float> anchors) const {
  std::vector<std::vector<Spot>> spots(planes_.size());
  const SpotGrid grid(anchors.width, anchors.height);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Spot spot = grid.At(column, row);
      const std::int32_t own = IndexAt(spot.x, spot.y);
      if (own >= 0 && !(anchors(spot.x, spot.y) > 0)) spots[static_cast<std::size_t>(own)].push_back(spot);
    }
  }
  return spots;
}

ViewRegions RegionPlanes::Tell() const {
  ViewRegions told;
  const SpotGrid grid(regions_->region.width(), regions_->region.height());
  told.label = Array2D<std::int32_t>(grid.columns, grid.rows, -1);
  for (std::size_t k = 0; k < planes_.size(); ++k) told.regions.push_back({{}, cells_[k], planes_[k]});
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Spot spot = grid.At(column, row);
      const std::int32_t region = IndexAt(spot.x, spot.y);
      told.label(column, row) = region;
      if (region < 0) continue;
      told.regions[static_cast<std::size_t>(region)].box.AddCell(column, row, grid.step);
    }
  }
  return told;
}

}  // namespace phi
