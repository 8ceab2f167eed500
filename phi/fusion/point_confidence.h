// How probable it is that a fused point is right, by what the images around say of it.
//
// A logistic model of four terms. scripts/fit_point_confidence makes the weights from scenes of the choosing half
// (docs/development/confidence.md). Right is a point no farther from the true surface than half a percent of its distance from the
// nearest camera that agrees on it.
#pragma once

#include <array>

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

// `angle`: degrees, as kPointAngle's.
PointTerms MakePointTerms(const PointSupport& point, const PointDoubts& doubts, float angle);

// The model's probability.
float PointConfidence(const PointTerms& terms);

}  // namespace phi
