#include "phi/inference/relative_exposure.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "phi/base/cauchy_weight.h"
#include "phi/base/median.h"

namespace phi {
namespace {

// From this on a camera may have cut off what is brighter, grey levels.
constexpr float kWhite = 250;
// Falloff is held near 0 as so many pairs would that show none: few or poorly spread ones tell of gloss as well.
constexpr double kPairsWithoutFalloff = 10;
constexpr int kNumRounds = 8;
// Residuals of the ratio of brightnesses. The least median; so many medians weigh half.
constexpr double kLeastResidual = 1e-3, kFarOff = 3;
// By its median a source counts beside the others, but none as more exact than this.
constexpr double kLeastDeviation = 0.02;

// One source's part of the fit. With the ratio q of the brightnesses and m the brightness without falloff over that with it:
// q m(reference) = gain m(source). Gauss and Newton's method, robust by weights that fall with the squared residual over that of the
// median pair; each source's own unknowns, gain and falloff, are eliminated from the reference's.
class SourceFit {
 public:
  explicit SourceFit(std::span<const SpotPair> pairs) : pairs_(pairs), residuals_(pairs.size()) {
    for (const SpotPair& pair : pairs) ratios_.push_back(pair.reference.brightness / pair.source.brightness);
    std::vector<double> scratch = ratios_;
    own_ = {Median(&scratch), 0};
  }

  double gain() const { return own_[0]; }
  double falloff() const { return own_[1]; }

  void Linearize(double reference_falloff) {
    const auto here = [&](std::size_t i) { return 1 + reference_falloff / 2 * pairs_[i].reference.squared_radius; };
    const auto there = [&](std::size_t i) { return 1 + own_[1] / 2 * pairs_[i].source.squared_radius; };
    for (std::size_t i = 0; i < pairs_.size(); ++i)
      residuals_[i] = ratios_[i] * here(i) * here(i) - own_[0] * there(i) * there(i);
    std::vector<double> sizes = residuals_;
    for (double& size : sizes) size = std::abs(size);
    const double middle = std::max(Median(&sizes), kLeastResidual);
    normal_ = Eigen::Vector3d(0, kPairsWithoutFalloff, kPairsWithoutFalloff).asDiagonal();
    right_ = -kPairsWithoutFalloff * Eigen::Vector3d(0, own_[1], reference_falloff);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const Eigen::Vector3d slope(there(i) * there(i), own_[0] * there(i) * pairs_[i].source.squared_radius,
                                  -ratios_[i] * here(i) * pairs_[i].reference.squared_radius);
      const double weight = CauchyWeight(residuals_[i] / (kFarOff * middle));
      normal_ += weight * slope * slope.transpose();
      right_ += weight * residuals_[i] * slope;
    }
    const double deviation = std::max(middle, kLeastDeviation);
    normal_ /= deviation * deviation;
    right_ /= deviation * deviation;
  }

  // What the pairs say of the reference's falloff, whatever the own unknowns are.
  void AddToReference(double* curvature, double* pull) const {
    const Eigen::Vector2d mixed = normal_.topRightCorner<2, 1>(), through = Own().solve(mixed);
    *curvature += normal_(2, 2) - through.dot(mixed);
    *pull += right_[2] - through.dot(right_.head<2>());
  }

  void Step(double of_reference) { own_ += Own().solve(right_.head<2>() - of_reference * normal_.topRightCorner<2, 1>()); }

 private:
  Eigen::LDLT<Eigen::Matrix2d> Own() const { return Eigen::Matrix2d(normal_.topLeftCorner<2, 2>()).ldlt(); }

  std::span<const SpotPair> pairs_;
  std::vector<double> ratios_, residuals_;
  Eigen::Vector2d own_;
  Eigen::Matrix3d normal_;
  Eigen::Vector3d right_;
};

}  // namespace

std::vector<RelativeExposure> RelativeExposure::Fit(std::span<const std::vector<SpotPair>> pairs_of_sources,
                                                    std::size_t min_num_pairs, double tone_prior) {
  std::vector<SourceFit> fits;
  std::vector<std::size_t> sources;
  for (std::size_t j = 0; j < pairs_of_sources.size(); ++j) {
    if (pairs_of_sources[j].empty() || pairs_of_sources[j].size() < min_num_pairs) continue;
    fits.emplace_back(pairs_of_sources[j]);
    sources.push_back(j);
  }
  double falloff = 0;  // of the reference
  for (int round = 0; round < kNumRounds && !fits.empty(); ++round) {
    tbb::parallel_for(std::size_t{0}, fits.size(), [&](std::size_t k) { fits[k].Linearize(falloff); });
    double curvature = 0, pull = 0;
    for (const SourceFit& fit : fits) fit.AddToReference(&curvature, &pull);
    const double step = pull / curvature;
    for (SourceFit& fit : fits) fit.Step(step);
    falloff += step;
  }
  std::vector<RelativeExposure> exposures(pairs_of_sources.size());
  for (std::size_t k = 0; k < fits.size(); ++k) {
    RelativeExposure& exposure = exposures[sources[k]];
    exposure.gain_ = static_cast<float>(fits[k].gain());
    exposure.source_falloff_ = static_cast<float>(fits[k].falloff());
    exposure.reference_falloff_ = static_cast<float>(falloff);
  }
  if (!(tone_prior > 0) || fits.empty()) return exposures;
  std::vector<SharedTones> shared;
  for (const std::size_t source : sources) shared.push_back(exposures[source].Unexplained(pairs_of_sources[source]));
  const std::vector<std::shared_ptr<const PhotoTones>> tones = PhotoTones::Fit(shared, tone_prior);
  for (std::size_t k = 0; k < tones.size(); ++k) exposures[sources[k]].tones_ = tones[k];
  return exposures;
}

SharedTones RelativeExposure::Unexplained(std::span<const SpotPair> pairs) const {
  SharedTones tones{pairs, {}};
  for (const auto& [reference, source] : pairs)
    tones.unexplained.push_back(std::log(reference.brightness / (RatioOfExposures(reference, source) * source.brightness)));
  return tones;
}

RelativeExposure RelativeExposure::OfOneImage(std::span<const RelativeExposure> exposures) {
  RelativeExposure own;
  // All that were fitted have the same.
  for (const RelativeExposure& exposure : exposures) {
    if (exposure.tones_ != nullptr) own.tones_ = exposure.tones_->OfReference();
    if (exposure.reference_falloff_ != 0) own.source_falloff_ = own.reference_falloff_ = exposure.reference_falloff_;
  }
  return own;
}

float RelativeExposure::Change(const BrightSpot& reference, const BrightSpot& source) const {
  const float change = reference.brightness - Ratio(reference, source) * source.brightness;
  const bool is_cut_off = change < 0 ? reference.brightness >= kWhite : source.brightness >= kWhite;
  return is_cut_off ? 0 : change;
}

}  // namespace phi
