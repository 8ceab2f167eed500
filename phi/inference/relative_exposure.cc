#include "phi/inference/relative_exposure.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace phi {
namespace {

// From this on a camera may have cut off what is brighter, grey levels.
constexpr float kWhite = 250;
// Falloff is held near 0 as so many pairs would that show none: few or poorly spread ones tell of gloss as well.
constexpr double kPairsWithoutFalloff = 10;
constexpr int kNumRounds = 8;
// Of residuals: the least median, and so many medians weigh half.
constexpr double kLeastResidual = 1e-3, kFarOff = 3;

double Median(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

}  // namespace

RadiusOfPixels::RadiusOfPixels(const Pinhole& k)
    : cx_(static_cast<float>(k.cx)),
      cy_(static_cast<float>(k.cy)),
      scale_(static_cast<float>(4 / (static_cast<double>(k.width) * k.width + static_cast<double>(k.height) * k.height))) {}

// With the ratio q of the brightnesses and m the brightness without falloff over that with it: q m(reference) = gain m(source). Gauss and Newton's
// method, robust by weights that fall with the squared residual over that of the median pair.
RelativeExposure RelativeExposure::Fit(std::span<const SpotPair> pairs, std::size_t min_num_pairs) {
  if (pairs.size() < min_num_pairs || pairs.empty()) return RelativeExposure();
  std::vector<double> ratios;
  for (const SpotPair& pair : pairs) ratios.push_back(pair.reference.brightness / pair.source.brightness);
  std::vector<double> scratch = ratios;
  Eigen::Vector3d x(Median(&scratch), 0, 0);  // gain, falloffs of source and reference
  std::vector<double> residuals(pairs.size());
  for (int round = 0; round < kNumRounds; ++round) {
    const auto root = [&](int which, const BrightSpot& spot) { return 1 + x[which] / 2 * spot.squared_radius; };
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double here = root(2, pairs[i].reference), there = root(1, pairs[i].source);
      residuals[i] = ratios[i] * here * here - x[0] * there * there;
    }
    scratch.resize(pairs.size());
    std::transform(residuals.begin(), residuals.end(), scratch.begin(), [](double r) { return std::abs(r); });
    const double middle = std::max(Median(&scratch), kLeastResidual);
    Eigen::Matrix3d normal = Eigen::Vector3d(0, kPairsWithoutFalloff, kPairsWithoutFalloff).asDiagonal();
    Eigen::Vector3d right = -kPairsWithoutFalloff * Eigen::Vector3d(0, x[1], x[2]);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double here = root(2, pairs[i].reference), there = root(1, pairs[i].source);
      const Eigen::Vector3d slope(there * there, x[0] * there * pairs[i].source.squared_radius,
                                  -ratios[i] * here * pairs[i].reference.squared_radius);
      const double off = residuals[i] / (kFarOff * middle), weight = 1 / (1 + off * off);
      normal += weight * slope * slope.transpose();
      right += weight * residuals[i] * slope;
    }
    x += normal.ldlt().solve(right);
  }
  RelativeExposure exposure(static_cast<float>(x[0]));
  exposure.source_falloff_ = static_cast<float>(x[1]);
  exposure.reference_falloff_ = static_cast<float>(x[2]);
  return exposure;
}

RelativeExposure RelativeExposure::OfOneImage(std::span<const RelativeExposure> exposures) {
  RelativeExposure own;
  if (exposures.empty()) return own;
  std::vector<double> falloffs;
  for (const RelativeExposure& exposure : exposures) falloffs.push_back(exposure.reference_falloff_);
  own.source_falloff_ = own.reference_falloff_ = static_cast<float>(Median(&falloffs));
  return own;
}

float RelativeExposure::Change(const BrightSpot& reference, const BrightSpot& source) const {
  const float over = (1 + source_falloff_ / 2 * source.squared_radius) / (1 + reference_falloff_ / 2 * reference.squared_radius);
  const float change = reference.brightness - gain_ * over * over * source.brightness;
  const bool is_cut_off = change < 0 ? reference.brightness >= kWhite : source.brightness >= kWhite;
  return is_cut_off ? 0 : change;
}

}  // namespace phi
