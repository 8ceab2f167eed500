// How probable it is that an estimated depth is right, by what the other views' estimates say of it, whether the surface goes
// on around the pixel, and how the photo is.
//
// A logistic model. scripts/fit_confidence makes the weights from scenes of the choosing half (docs/development/evidence.md).
// Right is a depth whose point lies within half a percent of its distance, or within two standard deviations of what matching
// can tell, of the true surface.
#pragma once

#include <array>
#include <functional>

#include "phi/base/array2d.h"
#include "phi/geometry/depth_precision.h"
#include "phi/measurement.h"

namespace phi {

// What the model knows of a pixel.
enum ConfidenceTerm {
  kConfirmingShare,  // of the views that say anything
  kConfirming,       // log2(1 + how many confirm)
  kContradicting,    // log2(1 + how many contradict)
  kAnyClose,         // 1: one of them confirms closely
  kAgreeingShare,    // of 24 neighbours three pixels apart, see neighbor_planes.h
  kNoise,            // log2(0.02 + a ninth of the variance of the photo's noise, squared grey levels)
  kNumConfidenceTerms
};
using ConfidenceTerms = std::array<float, kNumConfidenceTerms>;

// Calls function(x, y, terms) for each pixel of `estimate` with a depth, from several threads. `noise`: NoiseDeviation of the
// photo, grey levels; `precision`: of its view.
void ForConfidenceTerms(const PlaneMap& estimate, const Array2D<Testimonies>& testimonies, double noise,
                        const DepthPrecision& precision,
                        const std::function<void(int x, int y, const ConfidenceTerms& terms)>& function);

// The model's logarithm of the odds that the depth is right.
float ConfidenceLogOdds(const ConfidenceTerms& terms);

// From a probability of 0.8 on a depth is evidence for other pixels.
inline constexpr float kEvidenceLogOdds = 1.3862944f;

}  // namespace phi
