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
#include "phi/geometry/device_camera.h"
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
  kOwnTexture,            // log(0.02 + OwnTexture::variance)
  kOwnTextureOverNoise,   // log(0.05 + the same / (0.02 + a ninth of the noise's variance))
  kFacing,                // cosine of the angle between the surface's normal and the ray
  kRelativeDeviation,     // log(1e-4 + what matching can tell of the depth, DepthPrecision::RelativeDeviation)
  kNumConfidenceTerms
};
using ConfidenceTerms = std::array<float, kNumConfidenceTerms>;

// What the terms are found from. All arrays have one size.
struct ConfidenceInput {
  const RayModel& rays;  // of the estimate's view
  const PlaneMap& estimate;
  const Array2D<Testimonies>& testimonies;
  const Mask& wanted;                  // 0: not
  const Array2D<float>& deviations;    // DepthPrecision::RelativeDeviations of the estimate, where wanted
  const Array2D<float>& own_variance;  // of the photo, see own_texture.h
  double noise = 0;                    // of the photo: NoiseDeviation, grey levels
};

// Calls function(x, y, terms) for each wanted pixel of the estimate that has depth, from several threads.
void ForConfidenceTerms(const ConfidenceInput& input,
                        const std::function<void(int x, int y, const ConfidenceTerms& terms)>& function);

// The model's logarithm of the odds that the depth is right.
float ConfidenceLogOdds(const ConfidenceTerms& terms);

// From a probability of 0.8 on a depth that is no measurement is a clue.
inline constexpr float kClueLogOdds = 1.3862944f;

}  // namespace phi
