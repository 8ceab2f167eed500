#include "phi/inference/region_planes.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numeric>
#include <span>
#include <tuple>

#include <tbb/parallel_for.h>
#include <Eigen/Core>

#include "phi/base/image_mask.h"
#include "phi/base/random.h"
#include "phi/base/wide_vectors.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/infer_pixel.h"
#include "phi/inference/plane_choice.h"
#include "phi/inference/second_surface.h"

namespace phi {
namespace {

constexpr int kMinAnchors = 60;     // that a plane rests on
constexpr double kMinShare = 0.15;  // of the region's anchors not yet explained
// Of an inlier, relative inverse depth: the greater of a share and of standard deviations of what matching can tell.
constexpr float kTolerance = 0.003f, kToleranceDeviations = 3;
// Relative inverse depth: within this, two planes are one but for noise, or meet.
constexpr double kMinApart = 0.02;
constexpr int kMaxDraws = 100;
constexpr double kMinTriangle = 100;      // twice the area of a draw's, square pixels
constexpr double kConfidence = 0.9999;    // that one of the draws hit inliers only; no more are made then
constexpr std::size_t kMaxScored = 1500;  // anchors that a draw is scored on
constexpr int kMaxPoints = 8192;          // of a region, about: larger ones are sampled
constexpr double kMinSpread = 3;          // standard deviation across the inliers' narrow side, pixels
// Standard deviations of the inliers' places: so far from their mean, the fitted depth is about five times as uncertain.
constexpr double kReachDeviations = 5;
// Of a plane that a region chooses: cells of its anchors on it, at least, their share, and what makes a cell. Single points
// are mostly what other views mistook on plain walls.
constexpr int kMinCells = 3, kMinCellPoints = 2;
constexpr double kMinCellShare = 0.05;
constexpr double kMinUnlikeSky = 0.6;  // of the surface of the region's spots

// The same, scaled.
struct Limits {
  int min_anchors, max_draws;
  double min_share, min_apart, min_spread, reach_deviations;
  float tolerance, tolerance_deviations;

  explicit Limits(const Rules& rules)
      : min_anchors(rules.Count(Rule::kRegionPlanes, kMinAnchors)),
        max_draws(rules.Count(Rule::kRegionPlanes, kMaxDraws)) {
    const float scale = rules.Scale(Rule::kRegionPlanes);
    min_share = scale * kMinShare;
    min_apart = scale * kMinApart;
    min_spread = scale * kMinSpread;
    reach_deviations = scale * kReachDeviations;
    tolerance = scale * kTolerance;
    tolerance_deviations = scale * kToleranceDeviations;
  }

  AnchorTolerance Tolerance(const DepthPrecision& precision) const { return {tolerance, tolerance_deviations, precision}; }

  PlaneChoiceLimits Choice(float cell_side, const Rules& rules) const {
    return {rules.Count(Rule::kScenePlanes, kMinCells), rules.Scale(Rule::kScenePlanes) * kMinCellShare, min_apart,
            reach_deviations, cell_side, rules.Factor(Rule::kSpotBrightness), rules.Factor(Rule::kSourceRegions),
            rules.Factor(Rule::kSky) * kMinUnlikeSky};
  }
};

struct Point {
  float x, y;
  double w;
  double tolerance;    // of w
  std::uint32_t hash;  // of the pixel, once more than what sampled it: uniform again
};

// By hash, which pixels of two views may share.
bool Before(const Point& p, const Point& q) {
  return std::tie(p.hash, p.x, p.y, p.w) < std::tie(q.hash, q.x, q.y, q.w);
}

// In the order of Before. The hashes are uniform: of as many buckets as points each gets about one, and few are out of
// place after that.
std::vector<Point> Sorted(const std::vector<Point>& points) {
  const std::uint64_t n = points.size();
  const auto bucket = [n](const Point& p) { return static_cast<std::size_t>(p.hash * n >> 32); };
  std::vector<std::uint32_t> next(n + 1, 0);  // place for a bucket's next point
  for (const Point& p : points) ++next[bucket(p) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<Point> sorted(n);
  for (const Point& p : points) sorted[next[bucket(p)]++] = p;
  for (std::size_t i = 1; i < n; ++i) {
    const Point p = sorted[i];
    std::size_t place = i;
    for (; place > 0 && Before(p, sorted[place - 1]); --place) sorted[place] = sorted[place - 1];
    sorted[place] = p;
  }
  return sorted;
}

// A bijection: no two pixels share a value. Draws and samples go by this number and not by a place in a list, so that a
// anchor more or less changes only the draws that hit it.
std::uint32_t PixelHash(std::uint32_t pixel) {
  pixel ^= pixel >> 16;
  pixel *= 0x85EBCA6Bu;
  pixel ^= pixel >> 13;
  pixel *= 0xC2B2AE35u;
  return pixel ^ pixel >> 16;
}

// Least squares over the inliers; false when they do not carry a plane. Sets the ellipse.
bool Refine(const Limits& limits, const std::vector<Point>& points, RegionPlane* plane) {
  PlaneFit fit(points[0].x, points[0].y);
  for (const Point& p : points) {
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
const Point& PointAt(const std::vector<Point>& points, std::uint32_t word) {
  std::size_t next = static_cast<std::size_t>(std::uint64_t{word} * points.size() >> 32);
  while (next > 0 && points[next - 1].hash >= word) --next;
  while (next < points.size() && points[next].hash < word) ++next;
  return next == points.size() ? points.front() : points[next];
}

// The points that draws are scored on, a value after the other: loops over them become vector instructions.
class ScoredPoints {
 public:
  explicit ScoredPoints(std::span<const Point> points) {
    for (const Point& p : points) {
      x_.push_back(p.x);
      y_.push_back(p.y);
      w_.push_back(p.w);
      tolerance_.push_back(p.tolerance);
    }
  }

  std::size_t size() const { return x_.size(); }

  // Those on the plane; stops where they cannot be more than `needed`.
  std::size_t CountInliers(const ImagePlane& plane, std::size_t needed) const {
    constexpr std::size_t kBatch = 128;
    std::size_t count = 0;
    for (std::size_t begin = 0; begin < size() && count + size() - begin > needed; begin += kBatch) {
      count += static_cast<std::size_t>(Count(plane, begin, std::min(begin + kBatch, size())));
    }
    return count;
  }

 private:
  struct PlacedPoint {
    double x, y, w, tolerance;
  };

  PHI_WIDE_VECTORS std::int64_t Count(const ImagePlane& plane, std::size_t begin, std::size_t end) const {
    const ImagePlane own = plane;
    const double *x = x_.data(), *y = y_.data(), *w = w_.data(), *tolerance = tolerance_.data();
    std::int64_t count = 0;
    for (std::size_t i = begin; i < end; ++i) count += IsOn(own, PlacedPoint{x[i], y[i], w[i], tolerance[i]}) ? 1 : 0;
    return count;
  }

  std::vector<double> x_, y_, w_, tolerance_;
};

// The plane that most of the points agree on. Points by ascending hash: the first ones are a sample of them all.
bool FitPlane(const Limits& limits, const std::vector<Point>& points, RandomKey key, std::uint64_t region,
              std::uint32_t round, RegionPlane* best) {
  const ScoredPoints scored{std::span<const Point>(points).first(std::min(points.size(), kMaxScored))};
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

std::array<RegionPlane, kPlanesPerRegion> FitPlanes(const Limits& limits, std::vector<Point> points,
                                                    RandomKey key, std::uint64_t region) {
  std::array<RegionPlane, kPlanesPerRegion> planes{};
  for (int k = 0; k < kPlanesPerRegion && std::ssize(points) >= limits.min_anchors; ++k) {
    RegionPlane plane;
    if (!FitPlane(limits, points, key, region, static_cast<std::uint32_t>(k), &plane)) break;
    if (k > 0 && IsNoSecondSurface(points, planes[0], plane, limits.min_apart)) break;
    planes[k] = plane;
    std::erase_if(points, [&](const Point& p) { return IsOn(plane, p); });
  }
  return planes;
}

std::int32_t FetchAdd(std::int32_t* value, std::int32_t summand) {
  return std::atomic_ref<std::int32_t>(*value).fetch_add(summand, std::memory_order_relaxed);
}

// Measured pixels and pooled anchors of each region.
std::vector<std::int32_t> CountAnchors(const ImageRegions& regions, ArrayView2D<const float> anchors,
                                       std::span<const PooledAnchor> pooled) {
  std::vector<std::int32_t> counts(regions.num_regions, 0);
  tbb::parallel_for(0, anchors.height, [&](int y) {
    std::int32_t run_region = regions.region(0, y),
                 run = 0;  // one access per run: regions are shared by threads
    for (int x = 0; x < anchors.width; ++x) {
      const std::int32_t region = regions.region(x, y);
      if (region != run_region) {
        if (run > 0) FetchAdd(&counts[run_region], run);
        run_region = region;
        run = 0;
      }
      run += region >= 0 && anchors(x, y) > 0;
    }
    if (run > 0) FetchAdd(&counts[run_region], run);
  });
  for (const PooledAnchor& anchor : pooled) {
    const std::int32_t region = regions.region(anchor.PixelX(), anchor.PixelY());
    if (region >= 0) ++counts[region];
  }
  return counts;
}

// A region with enough anchors, and which of the members below are its own. A member is a pixel's index, or ~k for the
// pooled anchor k.
struct AnchoredRegion {
  std::int32_t region;
  std::uint32_t max_hash;  // of the anchors that become members
  std::int64_t begin;
  std::int32_t num_members = 0;
};

std::vector<AnchoredRegion> ListAnchored(const std::vector<std::int32_t>& counts, int min_anchors,
                                         std::int64_t* num_places) {
  std::vector<AnchoredRegion> list;
  *num_places = 0;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    if (counts[r] < min_anchors) continue;
    const double share = std::min(1.0, static_cast<double>(kMaxPoints) / counts[r]);
    list.push_back(
        {static_cast<std::int32_t>(r), static_cast<std::uint32_t>(share * 4294967295.0), *num_places});
    *num_places += counts[r];
  }
  return list;
}

// Without its tolerance.
Point MeasuredPoint(ArrayView2D<const float> anchors, std::int32_t pixel) {
  const int x = pixel % anchors.width, y = pixel / anchors.width;
  return {static_cast<float>(x), static_cast<float>(y), anchors(x, y), 0, PixelHash(PixelHash(pixel))};
}

// The same of what another view measured, about as precisely as this one would.
Point PooledPoint(const PooledAnchor& anchor) {
  return {anchor.x, anchor.y, anchor.inverse_depth, 0, PixelHash(anchor.hash)};
}

void SetTolerances(const AnchorTolerance& tolerance, std::vector<Point>* points) {
  std::vector<float> x, y, w;
  for (const Point& p : *points) {
    x.push_back(p.x);
    y.push_back(p.y);
    w.push_back(static_cast<float>(p.w));
  }
  const std::vector<double> found = tolerance.At(x, y, w);
  for (std::size_t i = 0; i < found.size(); ++i) (*points)[i].tolerance = found[i];
}

std::vector<AnchorCell> CellsOf(const std::vector<Point>& points, float side, int min_points,
                                const AnchorTolerance& tolerance) {
  std::vector<AnchorPoint> places;
  places.reserve(points.size());
  for (const Point& p : points) places.push_back({p.x, p.y, static_cast<float>(p.w)});
  return MakeAnchorCells(places, side, min_points, tolerance);
}

// Of the reference view, as its sources tell it.
DepthPrecision PrecisionOf(const InferenceInput& input) {
  std::vector<const Camera*> sources;
  for (const ViewImage& source : input.sources) sources.push_back(&source.view->camera);
  return {input.reference.view->camera, sources};
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

// Of each region, by index into its planes.
std::vector<std::vector<Spot>> SpotsWithoutAnchor(const Array2D<std::int32_t>& region, std::size_t num_regions,
                                                  ArrayView2D<const float> anchors) {
  std::vector<std::vector<Spot>> spots(num_regions);
  const SpotGrid grid(region.width(), region.height());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Spot spot = grid.At(column, row);
      const std::int32_t own = region(spot.x, spot.y);
      if (own >= 0 && !(anchors(spot.x, spot.y) > 0)) spots[static_cast<std::size_t>(own)].push_back(spot);
    }
  }
  return spots;
}

}  // namespace

PlaneEvidence GatherPlaneEvidence(const InferenceInput& input, const Rules& rules) {
  PlaneEvidence evidence;
  std::vector<float> gains;
  evidence.pooled = PoolAnchors(input, rules, &gains);
  evidence.precision = PrecisionOf(input);
  evidence.views.emplace(input, gains);
  evidence.sources = RegionsOfSources(input, rules);
  evidence.scene = FindScenePlanes(input, Limits(rules).Tolerance(evidence.precision), rules);
  return evidence;
}

ViewRegions FindViewRegions(const ImageRegions& regions, const MeasuredDepths& depths, std::uint32_t image_id,
                            const DepthPrecision& precision, const Rules& rules) {
  auto anchors = Array2D<float>::Uninitialized(depths.width(), depths.height());
  tbb::parallel_for(0, depths.height(), [&](int y) {
    for (int x = 0; x < depths.width(); ++x) {
      anchors(x, y) = AnchorAt(depths.states(x, y), depths.depths(x, y), Formulas::kRobust);
    }
  });
  PlaneEvidence own;
  own.precision = precision;
  return RegionPlanes(regions, std::as_const(anchors).view(), image_id, own, rules).Tell();
}

std::shared_ptr<const GrayImage> RegionImage(const InferenceInput& input) {
  if (input.mask == nullptr) return input.reference.image;
  return std::make_shared<const GrayImage>(CutOutMask(*input.reference.image, *input.mask));
}

std::shared_ptr<const ImageRegions> RegionsOf(const InferenceInput& input, const Rules& rules) {
  if (input.regions != nullptr) return input.regions;
  return std::make_shared<const ImageRegions>(FindRegions(*RegionImage(input), rules));
}

RegionPlanes::RegionPlanes(const ImageRegions& regions, ArrayView2D<const float> anchors, std::uint32_t image_id,
                           const PlaneEvidence& evidence, const Rules& rules)
    : tolerance_(Limits(rules).Tolerance(evidence.precision)) {
  const Limits limits(rules);
  const AnchorTolerance& tolerance = tolerance_;
  const std::vector<PooledAnchor>& pooled = evidence.pooled;
  const float side = CellSide(anchors.width);
  const PlaneChoiceLimits choice = limits.Choice(side, rules);
  const int min_cell_points = rules.Count(Rule::kScenePlanes, kMinCellPoints);
  const bool chooses = !evidence.scene.empty() || !evidence.sources.empty();
  const int min_anchors = chooses ? choice.min_cells * min_cell_points : limits.min_anchors;
  std::int64_t num_places = 0;
  std::vector<AnchoredRegion> anchored =
      ListAnchored(CountAnchors(regions, anchors, pooled), min_anchors, &num_places);
  std::vector<std::int32_t> index(regions.num_regions, -1);
  for (std::size_t k = 0; k < anchored.size(); ++k) index[anchored[k].region] = static_cast<std::int32_t>(k);

  const auto members = std::make_unique_for_overwrite<std::int32_t[]>(num_places);
  const auto add_member = [&](AnchoredRegion& own, std::uint32_t hash, std::int32_t member) {
    if (hash <= own.max_hash) members[own.begin + FetchAdd(&own.num_members, 1)] = member;
  };
  region_ = Array2D<std::int32_t>::Uninitialized(anchors.width, anchors.height);
  tbb::parallel_for(0, anchors.height, [&](int y) {
    for (int x = 0; x < anchors.width; ++x) {
      const std::int32_t found = regions.region(x, y), region = found >= 0 ? index[found] : -1;
      region_(x, y) = region;
      if (region < 0 || !(anchors(x, y) > 0)) continue;
      const std::int32_t pixel = y * anchors.width + x;
      add_member(anchored[region], PixelHash(pixel), pixel);
    }
  });
  for (std::size_t k = 0; k < pooled.size(); ++k) {
    const std::int32_t region = region_(pooled[k].PixelX(), pooled[k].PixelY());
    if (region >= 0) add_member(anchored[region], pooled[k].hash, ~static_cast<std::int32_t>(k));
  }

  planes_.resize(anchored.size());
  cells_.resize(anchored.size());
  const std::vector<std::vector<Spot>> spots = SpotsWithoutAnchor(region_, anchored.size(), anchors);
  const SpotViews* views = evidence.views ? &*evidence.views : nullptr;
  tbb::parallel_for(std::size_t{0}, anchored.size(), [&](std::size_t k) {
    const AnchoredRegion& own = anchored[k];
    const std::int32_t* begin = members.get() + own.begin;
    std::vector<Point> points;
    points.reserve(own.num_members);
    for (const std::int32_t* member = begin; member != begin + own.num_members; ++member) {
      points.push_back(*member >= 0 ? MeasuredPoint(anchors, *member) : PooledPoint(pooled[~*member]));
    }
    SetTolerances(tolerance, &points);
    points = Sorted(points);  // threads found them in any order
    planes_[k] = FitPlanes(limits, points, {0, image_id}, static_cast<std::uint64_t>(own.region));
    cells_[k] = CellsOf(points, side, min_cell_points, tolerance);
    if (chooses) planes_[k] = ChoosePlanes({cells_[k], spots[k], views, evidence.sources}, planes_[k], evidence.scene, choice);
  });
}

const std::array<RegionPlane, kPlanesPerRegion>& RegionPlanes::At(int x, int y) const {
  static const std::array<RegionPlane, kPlanesPerRegion> kNone{};
  const std::int32_t region = region_(x, y);
  return region < 0 ? kNone : planes_[region];
}

ViewRegions RegionPlanes::Tell() const {
  ViewRegions told;
  const SpotGrid grid(region_.width(), region_.height());
  told.label = Array2D<std::int32_t>(grid.columns, grid.rows, -1);
  for (std::size_t k = 0; k < planes_.size(); ++k) told.regions.push_back({{}, cells_[k], planes_[k]});
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Spot spot = grid.At(column, row);
      const std::int32_t region = region_(spot.x, spot.y);
      told.label(column, row) = region;
      if (region < 0) continue;
      told.regions[static_cast<std::size_t>(region)].box.AddCell(column, row, grid.step);
    }
  }
  return told;
}

}  // namespace phi
