// How probable it is that an estimated depth is right, by what the other views' estimates say of it, whether the surface goes
// on around the pixel, and how the photo is there.
//
// A logistic model. scripts/fit_confidence makes the weights from scenes of the choosing half (docs/development/evidence.md).
// Right is a depth whose point lies within half a percent of its distance, or within two standard deviations of what matching
// can tell, of the true surface.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "phi/base/hd.h"
#include "phi/filtering/neighbor_agreement.h"
#include "phi/measurement.h"

namespace phi {

// What the model knows of a pixel. log2 throughout.
enum ConfidenceTerm {
  kConfirmingShare,       // of the views that say anything
  kClose,                 // log(1 + how many confirm closely)
  kLoose,                 // log(1 + how many confirm, but not closely)
  kContradicting,         // log(1 + how many contradict)
  kAnyClose,              // 1: one confirms closely
  kTwo,                   // 1: two confirm
  kAgreeingShare,         // of 24 neighbours three pixels apart, see neighbor_agreement.h
  kOwnTexture,            // log(0.02 + OwnTexture::variance)
  kOwnTextureOverNoise,   // log(0.05 + the same / (0.02 + a ninth of the noise's variance))
  kFacing,                // cosine of the angle between the surface's normal and the ray
  kRelativeDeviation,     // log(1e-4 + what matching can tell of the depth, DepthPrecision::RelativeDeviation)
  kNumConfidenceTerms
};
using ConfidenceTerms = std::array<float, kNumConfidenceTerms>;

inline constexpr int kConfidenceSpacing = 3;  // of the neighbours, pixels: windows that overlap less than the next pixel's

// log2(1 + n), 0 <= n < 256. The processor looks it up: logarithms of counts are taken for millions of pixels.
PHI_HD float LogOfCount(int n) {
#ifdef __CUDA_ARCH__
  return log2f(1.0f + static_cast<float>(n));
#else
  static const auto kLogs = [] {
    std::array<float, std::numeric_limits<std::uint8_t>::max() + 1> logs;
    for (std::size_t i = 0; i < logs.size(); ++i) logs[i] = std::log2(1.0f + static_cast<float>(i));
    return logs;
  }();
  return kLogs[static_cast<std::size_t>(n)];
#endif
}

// Of a photo's noise, what the model compares own texture with. noise: NoiseDeviation, grey levels.
inline float SmoothedNoise(double noise) {
  // The weights were fitted to noise as it differs from pixel to pixel, of which JPEG leaves this share.
  constexpr double kNoiseOfFit = 0.3;
  const double of_fit = kNoiseOfFit * noise;
  return static_cast<float>(0.02 + of_fit * of_fit / 9);
}

// What the terms of a pixel are made of.
struct ConfidenceEvidence {
  Testimonies testimonies;
  int num_agreeing;      // CountAgreeingAround
  float own_variance;    // OwnTexture::variance
  float smoothed_noise;  // SmoothedNoise
  float deviation;       // DepthPrecision::RelativeDeviation
};

// ray: through the pixel; normal: of its plane.
PHI_HD ConfidenceTerms MakeConfidenceTerms(const ConfidenceEvidence& e, Vec3f normal, Vec3f ray) {
  const Testimonies& t = e.testimonies;
  const int telling = t.num_confirming + t.num_contradicting;
  ConfidenceTerms terms{};
  terms[kConfirmingShare] = static_cast<float>(t.num_confirming) / static_cast<float>(telling > 1 ? telling : 1);
  terms[kClose] = LogOfCount(t.num_close);
  terms[kLoose] = LogOfCount(t.num_confirming - t.num_close);
  terms[kContradicting] = LogOfCount(t.num_contradicting);
  terms[kAnyClose] = t.num_close > 0;
  terms[kTwo] = t.num_confirming >= 2;
  terms[kAgreeingShare] = static_cast<float>(e.num_agreeing) / static_cast<float>(kNumNeighbors);
  terms[kOwnTexture] = log2f(0.02f + e.own_variance);
  terms[kOwnTextureOverNoise] = log2f(0.05f + e.own_variance / e.smoothed_noise);
  terms[kFacing] = -Dot(normal, ray) / Norm(ray);
  terms[kRelativeDeviation] = log2f(1e-4f + e.deviation);
  return terms;
}

// The model's logarithm of the odds that the depth is right.
PHI_HD float ConfidenceLogOdds(const ConfidenceTerms& terms) {
  // As the fit printed them, in the order of ConfidenceTerm.
  constexpr float kWeights[kNumConfidenceTerms] = {2.978f, 0.048f, -0.390f, 0.339f, -0.182f, 0.288f, 3.095f, -0.432f, 0.478f, 0.428f, -0.051f};
  constexpr float kConstant = -5.131f;
  float sum = kConstant;
  for (int i = 0; i < kNumConfidenceTerms; ++i) sum += kWeights[i] * terms[static_cast<std::size_t>(i)];
  return sum;
}

// From a probability of 0.8 on a depth that is no measurement is a clue.
inline constexpr float kClueLogOdds = 1.3862944f;

}  // namespace phi
