#include "phi/filtering/confidence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "phi/filtering/neighbor_planes.h"

namespace phi {
namespace {

constexpr int kNeighborSpacing = 3;  // pixels: windows that overlap less than the next pixel's

// As the fit printed them, in the order of ConfidenceTerm.
constexpr ConfidenceTerms kWeights = {2.978f, 0.048f, -0.390f, 0.339f, -0.182f, 0.288f, 3.095f, -0.432f, 0.478f, 0.428f, -0.051f};
constexpr float kConstant = -5.131f;

// log2(1 + n): logarithms of counts are taken for millions of pixels.
float LogOfCount(int n) {
  static const auto kLogs = [] {
    std::array<float, std::numeric_limits<std::uint8_t>::max() + 1> logs;
    for (std::size_t i = 0; i < logs.size(); ++i) logs[i] = std::log2(1.0f + static_cast<float>(i));
    return logs;
  }();
  return kLogs[static_cast<std::size_t>(n)];
}

// The weights were fitted to noise as it differs from pixel to pixel, of which JPEG leaves this share.
constexpr double kNoiseOfFit = 0.3;

void SetViewTerms(const Testimonies& t, ConfidenceTerms* terms) {
  const int telling = std::max(1, t.num_confirming + t.num_contradicting);
  (*terms)[kConfirmingShare] = static_cast<float>(t.num_confirming) / static_cast<float>(telling);
  (*terms)[kClose] = LogOfCount(t.num_close);
  (*terms)[kLoose] = LogOfCount(t.num_confirming - t.num_close);
  (*terms)[kContradicting] = LogOfCount(t.num_contradicting);
  (*terms)[kAnyClose] = t.num_close > 0;
  (*terms)[kTwo] = t.num_confirming >= 2;
}

}  // namespace

void ForConfidenceTerms(const ConfidenceInput& input,
                        const std::function<void(int x, int y, const ConfidenceTerms& terms)>& function) {
  const double noise = kNoiseOfFit * input.noise;
  const auto smoothed_noise = static_cast<float>(0.02 + noise * noise / 9);
  ForNeighborCounts(
      input.rays, input.estimate, input.wanted, input.deviations, kNeighborSpacing,
      [&](int y, const std::vector<std::int32_t>& num_agreeing) {
        for (int x = 0; x < input.estimate.width(); ++x) {
          const PlaneHypothesis& h = input.estimate(x, y);
          if (input.wanted(x, y) == 0 || !(h.depth > 0)) continue;
          const Vec3f ray = input.rays.Ray(x + 0.5f, y + 0.5f);
          const float own_variance = input.own_variance(x, y);
          ConfidenceTerms terms;
          SetViewTerms(input.testimonies(x, y), &terms);
          terms[kAgreeingShare] = static_cast<float>(num_agreeing[x]) / static_cast<float>(kNumNeighbors);
          terms[kOwnTexture] = std::log2(0.02f + own_variance);
          terms[kOwnTextureOverNoise] = std::log2(0.05f + own_variance / smoothed_noise);
          terms[kFacing] = -Dot(h.normal, ray) / Norm(ray);
          terms[kRelativeDeviation] = std::log2(1e-4f + input.deviations(x, y));
          function(x, y, terms);
        }
      });
}

float ConfidenceLogOdds(const ConfidenceTerms& terms) {
  float sum = kConstant;
  for (std::size_t i = 0; i < terms.size(); ++i) sum += kWeights[i] * terms[i];
  return sum;
}

}  // namespace phi
