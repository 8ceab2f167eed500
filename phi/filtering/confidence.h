// How probable it is that an estimated depth is right, by what the other views' estimates say of it, whether the surface goes
// on around the pixel, and how the photo is there.
//
// A logistic model. scripts/fit_confidence makes the weights from scenes of the choosing half (docs/development/evidence.md).
// Right is a depth whose point lies within half a percent of its distance, or within two standard deviations of what matching
// can tell, of the true surface.
#pragma once

#include <array>
#include <functional>

#include "phi/base/array2d.h"
#include "phi/base/images.h"
#include "phi/geometry/depth_precision.h"
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
  kAgreeingShare,         // of 24 neighbours three pixels apart, see neighbor_planes.h
  kOwnTexture,            // log(0.02 + OwnVariance)
  kOwnTextureOverNoise,   // log(0.05 + OwnVariance / (0.02 + a ninth of the noise's variance))
  kFacing,                // cosine of the angle between the surface's normal and the ray
  kRelativeDeviation,     // log(1e-4 + what matching can tell of the depth, DepthPrecision::RelativeDeviation)
  kNumConfidenceTerms
};
using ConfidenceTerms = std::array<float, kNumConfidenceTerms>;

// Calls function(x, y, terms) for each pixel of `estimate` with a depth, from several threads. `photo`: the reference, grey;
// `noise`: its NoiseDeviation, grey levels; `precision`: of its view.
void ForConfidenceTerms(const GrayImage& photo, double noise, const DepthPrecision& precision, const PlaneMap& estimate,
                        const Array2D<Testimonies>& testimonies,
                        const std::function<void(int x, int y, const ConfidenceTerms& terms)>& function);

// The model's logarithm of the odds that the depth is right.
float ConfidenceLogOdds(const ConfidenceTerms& terms);

// From a probability of 0.8 on a depth is evidence for other pixels. Nothing is published that is more probably wrong than right.
inline constexpr float kEvidenceLogOdds = 1.3862944f, kPublishedLogOdds = 0;

}  // namespace phi
