// How probable it is that a fused point is right, by what the images around say of it.
//
// A logistic model of four terms. scripts/fit_point_confidence makes the weights from scenes of the choosing half
// (docs/development/confidence.md). Right is a point no farther from the true surface than half a percent of its distance from the
// nearest camera that agrees on it.
#pragma once

#include <array>
#include <cstdint>

#include "phi/fusion/support_pixel.h"

namespace phi {

// What the model knows of a point. log2 throughout.
enum PointTerm {
  kPointMeasured,    // log(1 + the images that agree and measured it)
  kPointShare,       // of the images that look there, and from which nothing hides it: those that agree
  kPointAngle,       // log(0.3 + the widest angle between the reference's ray and an agreeing image's, degrees)
  kPointBrightness,  // log(1 + the standard deviation of the agreeing images' brightness, grey levels)
  kNumPointTerms
};
using PointTerms = std::array<float, kNumPointTerms>;

// Rates up to kSize points at once, in vectors: one alone waits for its own logarithms, roots and divisions (60 ns).
class PointRater {
 public:
  static constexpr int kSize = 16;

  // The next point, number 0 first.
  void Add(const PointSupport& point, const PointDoubts& doubts);
  int size() const { return size_; }
  // All that were added.
  void Rate();

  PointTerms TermsOf(int number) const;
  // The model's probability.
  float ConfidenceOf(int number) const { return confidence_[number]; }

 private:
  void MakeTerms();

  int size_ = 0;
  // Of each point.
  std::int32_t num_views_[kSize] = {}, num_measured_[kSize] = {}, num_against_[kSize] = {};
  std::int32_t brightness_sum_[kSize] = {}, brightness_squares_[kSize] = {};  // of red + green + blue
  float least_cosine_[kSize] = {};
  float terms_[kNumPointTerms][kSize];
  float confidence_[kSize];
};

}  // namespace phi
