// The view policy's matcher (see estimate_pixel.h) over the vectorised cost; scalar_matcher.h is the readable
// one.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/cpu/simd_image.h"
#include "phi/cpu/simd_zncc.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {

// Packs the images of one reference: 4 bytes a pixel for the reference and each source while the matcher
// lives. LoadPatch and Costs allocate nothing and may be called from many threads.
class SimdMatcher {
 public:
  using Patch = SimdPatch;

  SimdMatcher(const EstimationInput& input, const EstimationParameters& parameters,
              const std::vector<RelativeView>& views);

  Patch LoadPatch(int x, int y) const {
    Patch patch;
    LoadSimdPatch(reference_, window_, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, &patch);
    return patch;
  }

  // One cost per source view.
  void Costs(const Patch& patch, int x, int y, const PlaneHypothesis& h, float* costs) const;

 private:
  RayModel rays_;
  SimdWindow window_;
  PackedImage reference_;
  std::vector<PackedImage> images_;
  std::vector<SimdSource> sources_;
};

}  // namespace phi
