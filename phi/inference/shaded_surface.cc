#include "phi/inference/shaded_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "phi/base/cauchy_weight.h"

namespace phi {
namespace {

constexpr std::size_t kMaxSpots = 1500;         // that are asked
constexpr std::size_t kMinObservations = 100;   // of a spot by a source
constexpr float kHalfWeight = 2;                // grey levels: a difference of that counts half
constexpr float kMaxDifference = 20;            // grey levels, in means: more is something else
constexpr std::size_t kMinViews = 3;            // of most spots: of two views each has a gloss of its own
constexpr int kMaxRounds = 20;
constexpr double kSettled = 1e-4;               // relative change of the cost
constexpr double kFirstDamping = 1e-3, kLeastDamping = 1e-6, kMostDamping = 1e3;
constexpr double kMaxFactor = 3;                // of the start's inverse depth in the middle, that a spot's may be

constexpr int kNumTerms = 6;
using Terms = Eigen::Matrix<double, kNumTerms, 1>;
using Normal = Eigen::Matrix<double, kNumTerms, kNumTerms>;

// So many of them, evenly.
std::vector<Spot> Thinned(std::span<const Spot> spots) {
  if (spots.size() <= kMaxSpots) return {spots.begin(), spots.end()};
  std::vector<Spot> fewer;
  for (std::size_t i = 0; i < kMaxSpots; ++i) fewer.push_back(spots[i * spots.size() / kMaxSpots]);
  return fewer;
}

struct Places {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();  // and of a pixel's size

  explicit Places(std::span<const Spot> spots) {
    const auto n = static_cast<double>(spots.size());
    for (const Spot& spot : spots) mean += Eigen::Vector2d(spot.x, spot.y) / n;
    for (const Spot& spot : spots) {
      const Eigen::Vector2d off = Eigen::Vector2d(spot.x, spot.y) - mean;
      covariance += off * off.transpose() / n;
    }
  }
  double Scale() const { return std::sqrt(covariance.diagonal().maxCoeff()); }
};

class ShadeSearch {
 public:
  ShadeSearch(const SpotViews& views, std::span<const Spot> spots, const RegionPlane& start)
      : views_(views), spots_(Thinned(spots)), places_(spots), scale_(places_.Scale()) {
    for (const Spot& spot : spots_) {
      here_.push_back(views_.MeanHere(spot));
      terms_.push_back(TermsAt(spot));
    }
    const Eigen::Vector2d& mean = places_.mean;
    surface_ << start.InverseDepth(mean.x(), mean.y()), start.b * scale_, start.c * scale_, 0, 0, 0;
    start_ = surface_;
    observed_ = Observe(surface_);
  }

  // False: too little is seen of the spots, or of the surface that was found.
  bool Run() {
    const std::size_t num_first = observed_.size();
    if (num_first < kMinObservations) return false;
    double cost = Cost(observed_), damping = kFirstDamping;
    for (int round = 0; round < kMaxRounds && damping <= kMostDamping; ++round) {
      const Terms moved = surface_ + Step(damping);
      std::vector<Observation> observed = Observe(moved);
      // A surface that the views no longer show leaves nothing to explain.
      const bool is_seen = observed.size() >= std::max(kMinObservations, num_first / 2);
      const double then = is_seen ? Cost(observed) : cost;
      if (!(then < cost)) {
        damping *= 10;
        continue;
      }
      const bool has_settled = cost - then < kSettled * cost;
      cost = then;
      surface_ = moved;
      observed_ = std::move(observed);
      damping = std::max(damping / 10, kLeastDamping);
      if (has_settled) break;
    }
    return std::all_of(terms_.begin(), terms_.end(), [&](const Terms& terms) {
      const double w = terms.dot(surface_);
      return w > start_[0] / kMaxFactor && w < start_[0] * kMaxFactor;
    });
  }

  // Mean difference of brightness, grey levels.
  double Left() const {
    double sum = 0;
    for (const Observation& o : observed_) sum += std::min(std::abs(o.change), kMaxDifference);
    return observed_.empty() ? kMaxDifference : sum / static_cast<double>(observed_.size());
  }

  // Grey levels by which a per cent of depth changes the brightness, root mean square.
  double ChangePerCent() const {
    double weights = 0, squares = 0;
    for (const Observation& o : observed_) {
      const double weight = Weight(o);
      weights += weight;
      squares += weight * o.slope * o.slope;
    }
    return weights > 0 ? 0.01 * surface_[0] * std::sqrt(squares / weights) : 0;
  }

  // As the surface that was found has it.
  bool AreMostSeenBy(std::size_t num_views) const {
    std::vector<std::size_t> seen_by(spots_.size());
    for (const Observation& o : observed_) ++seen_by[o.spot];
    const auto num = std::count_if(seen_by.begin(), seen_by.end(), [&](std::size_t n) { return n >= num_views; });
    return 2 * num > std::ssize(spots_);
  }

  // By which the spots' inverse depths are off the start's, mean.
  double MovedPerCent() const {
    double sum = 0;
    for (const Terms& terms : terms_) sum += std::abs(terms.dot(surface_ - start_) / terms.dot(start_));
    return 100 * sum / static_cast<double>(terms_.size());
  }

  RegionPlane Surface(double reach_deviations) const {
    RegionPlane surface;
    const double x = places_.mean.x(), y = places_.mean.y(), squared = scale_ * scale_;
    surface.b = surface_[1] / scale_;
    surface.c = surface_[2] / scale_;
    surface.a = surface_[0] - surface.b * x - surface.c * y;
    surface.bend = {x, y, surface_[3] / squared, surface_[4] / squared, surface_[5] / squared};
    surface.SetReach(places_.mean, places_.covariance, reach_deviations);
    return surface;
  }

 private:
  struct Observation {
    std::size_t spot;
    float change, slope;  // ShadeOfSpot's
  };

  // 1, x, y, x^2, x y, y^2 of the place, in standard deviations.
  Terms TermsAt(const Spot& spot) const {
    const double x = (spot.x - places_.mean.x()) / scale_, y = (spot.y - places_.mean.y()) / scale_;
    return (Terms() << 1, x, y, x * x, x * y, y * y).finished();
  }

  std::vector<Observation> Observe(const Terms& surface) const {
    std::vector<Observation> observed;
    for (std::size_t i = 0; i < spots_.size(); ++i) {
      const auto w = static_cast<float>(terms_[i].dot(surface));
      if (!here_[i] || !(w > 0)) continue;
      for (std::size_t j = 0; j < views_.NumSources(); ++j) {
        if (const auto shade = views_.ShadeIn(j, spots_[i], *here_[i], w)) observed.push_back({i, shade->change, shade->slope});
      }
    }
    return observed;
  }

  static double Weight(const Observation& o) { return CauchyWeight(o.change / kHalfWeight); }
  static double Cost(const std::vector<Observation>& observed) {
    double sum = 0;
    for (const Observation& o : observed) sum += std::log1p(o.change * o.change / (kHalfWeight * kHalfWeight));
    return sum / static_cast<double>(observed.size());
  }

  Terms Step(double damping) const {
    Normal normal = Normal::Zero();
    Terms pull = Terms::Zero();
    for (const Observation& o : observed_) {
      const double weight = Weight(o);
      normal.noalias() += weight * o.slope * o.slope * terms_[o.spot] * terms_[o.spot].transpose();
      pull.noalias() -= weight * o.slope * o.change * terms_[o.spot];
    }
    constexpr double kAlways = 1e-9;  // of the trace: where shade tells nothing of a term
    const double least = kAlways * normal.trace();
    normal.diagonal() *= 1 + damping;
    normal.diagonal().array() += least;
    return normal.ldlt().solve(pull);
  }

  const SpotViews& views_;
  std::vector<Spot> spots_;
  Places places_;
  double scale_;
  std::vector<std::optional<BoxMean>> here_;  // as spots_
  std::vector<Terms> terms_;                  // as spots_
  Terms start_, surface_;
  std::vector<Observation> observed_;
};

double CountOn(const RegionPlane& surface, std::span<const AnchorCell> cells) {
  return static_cast<double>(
      std::count_if(cells.begin(), cells.end(), [&](const AnchorCell& cell) { return IsOn(surface, cell); }));
}

// By more than the standard deviation of the difference of two such counts.
bool MoreLieOn(const RegionPlane& surface, const RegionPlane& start, std::span<const AnchorCell> cells) {
  const double on_surface = CountOn(surface, cells), on_start = CountOn(start, cells);
  return on_surface - on_start > std::sqrt(on_surface + on_start);
}

// `before`: the mean difference of brightness that the start leaves.
bool IsToldByShadeAlone(const ShadeSearch& found, double before, const ShadeLimits& limits) {
  const double change = found.ChangePerCent();
  return found.AreMostSeenBy(kMinViews) && change >= limits.min_change && found.Left() < limits.max_left &&
         found.MovedPerCent() * change < limits.max_moved * before;
}

}  // namespace

std::optional<RegionPlane> SurfaceByShade(const SpotViews& views, std::span<const Spot> spots, std::span<const AnchorCell> cells,
                                          const RegionPlane& start, double reach_deviations, const ShadeLimits& limits) {
  if (spots.empty()) return std::nullopt;
  ShadeSearch found(views, spots, start);
  const double before = found.Left();
  if (!found.Run() || !(found.Left() < limits.max_left_share * before)) return std::nullopt;
  const RegionPlane surface = found.Surface(reach_deviations);
  if (MoreLieOn(surface, start, cells) || IsToldByShadeAlone(found, before, limits)) return surface;
  return std::nullopt;
}

}  // namespace phi
