#include "phi/fusion/point_confidence.h"

#include <cmath>

#include "phi/fusion/term_functions.h"

namespace phi {
namespace {

// As the fit printed them, in the order of PointTerm.
constexpr PointTerms kPointWeights = {1.549f, 3.394f, 0.410f, -0.308f};
constexpr float kPointConstant = -1.340f;

constexpr float kLeastAngle = 0.3f;  // degrees

// Grey levels. Of numbers below 2^26, whose products doubles hold.
inline float BrightnessDeviation(std::int32_t num_views, std::int32_t sum, std::int32_t squares) {
  const double n = num_views, s = sum;
  return std::sqrt(static_cast<float>(n * squares - s * s)) / static_cast<float>(3 * num_views);
}

}  // namespace

void PointRater::Add(const PointSupport& point, const PointDoubts& doubts) {
  const int i = size_++;
  num_views_[i] = point.num_views;
  num_measured_[i] = point.num_views - point.num_inferred;
  num_against_[i] = doubts.num_contradicting + doubts.num_without_depth;
  brightness_sum_[i] = point.rgb_sum[0] + point.rgb_sum[1] + point.rgb_sum[2];
  brightness_squares_[i] = point.brightness_squares;
  least_cosine_[i] = point.least_cosine;
}

// All places, also those without a point: loops of a fixed length become vectors. One term a loop keeps what the loop needs in
// registers.
void PointRater::MakeTerms() {
  for (int i = 0; i < kSize; ++i) terms_[kPointMeasured][i] = Log2(1.0f + static_cast<float>(num_measured_[i]));
  for (int i = 0; i < kSize; ++i) {
    terms_[kPointShare][i] = static_cast<float>(num_views_[i]) / static_cast<float>(num_views_[i] + num_against_[i]);
  }
  for (int i = 0; i < kSize; ++i) terms_[kPointAngle][i] = Log2(kLeastAngle + DegreesOfCosine(least_cosine_[i]));
  float deviation[kSize];
  for (int i = 0; i < kSize; ++i) deviation[i] = BrightnessDeviation(num_views_[i], brightness_sum_[i], brightness_squares_[i]);
  for (int i = 0; i < kSize; ++i) terms_[kPointBrightness][i] = Log2(1 + deviation[i]);
}

void PointRater::Rate() {
  MakeTerms();
  float log_odds[kSize];
  for (int i = 0; i < kSize; ++i) log_odds[i] = kPointConstant;
  for (int t = 0; t < kNumPointTerms; ++t) {
    for (int i = 0; i < kSize; ++i) log_odds[i] += kPointWeights[static_cast<std::size_t>(t)] * terms_[t][i];
  }
  // Apart, since compilers make no vectors of a loop in which what follows a bound may be worked out ahead.
  for (int i = 0; i < kSize; ++i) log_odds[i] = Clamp(log_odds[i], -kMostLogOdds, kMostLogOdds);
  for (int i = 0; i < kSize; ++i) confidence_[i] = Logistic(log_odds[i]);
}

PointTerms PointRater::TermsOf(int number) const {
  PointTerms terms;
  for (std::size_t t = 0; t < kNumPointTerms; ++t) terms[t] = terms_[t][number];
  return terms;
}

}  // namespace phi
