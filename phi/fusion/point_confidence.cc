#include "phi/fusion/point_confidence.h"

#include <cmath>
#include <cstdint>

namespace phi {
namespace {

// As the fit printed them, in the order of PointTerm.
constexpr PointTerms kPointWeights = {1.088f, 2.933f, 0.424f, -0.247f};
constexpr float kPointConstant = -1.500f;

constexpr float kLeastAngle = 0.3f;  // degrees

float BrightnessDeviation(const PointSupport& point) {
  const std::int64_t n = point.num_views, sum = point.rgb_sum[0] + point.rgb_sum[1] + point.rgb_sum[2];
  return std::sqrt(static_cast<float>(n * point.brightness_squares - sum * sum)) / static_cast<float>(3 * n);
}

}  // namespace

PointTerms MakePointTerms(const PointSupport& point, const PointDoubts& doubts, float angle) {
  PointTerms terms;
  terms[kPointMeasured] = std::log2(1.0f + static_cast<float>(point.num_views - point.num_inferred));
  terms[kPointShare] = static_cast<float>(point.num_views) /
                       static_cast<float>(point.num_views + doubts.num_contradicting + doubts.num_without_depth);
  terms[kPointAngle] = std::log2(kLeastAngle + angle);
  terms[kPointBrightness] = std::log2(1 + BrightnessDeviation(point));
  return terms;
}

float PointConfidence(const PointTerms& terms) {
  float log_odds = kPointConstant;
  for (int i = 0; i < kNumPointTerms; ++i) log_odds += kPointWeights[i] * terms[i];
  return 1 / (1 + std::exp(-log_odds));
}

}  // namespace phi
