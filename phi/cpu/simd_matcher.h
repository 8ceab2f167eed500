// The view policy's matcher (see estimate_pixel.h) over the vectorised cost; scalar_matcher.h is the readable one.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/cpu/simd_image.h"
#include "phi/cpu/simd_zncc.h"
#include "phi/matching/estimate_pixel.h"
#include "phi/matching/window_level.h"

namespace phi {

// Packs the images of one reference, all pyramid levels: 4 bytes a pixel for the reference and each source (a third
// more with the coarser levels) while the matcher lives. Patches have sparse samples where the parameters ask for
// them. LoadPatch and Costs allocate nothing and may be called from many threads.
class SimdMatcher {
 public:
  struct Patch {
    WindowScale scale;
    SimdPatch all, sparse;
  };

  SimdMatcher(const EstimationInput& input, const EstimationParameters& parameters,
              const std::vector<RelativeView>& views);

  Patch LoadPatch(int x, int y) const {
    Patch patch;
    patch.scale = window_scales_(x, y);
    const float scale = 1.0f / static_cast<float>(1 << patch.scale.level);
    const float decay = WindowAtScale(matching_window_, patch.scale).weight_decay;
    const PackedImage& image = levels_[patch.scale.level].reference;
    const Windows& windows = Window(patch.scale);
    LoadSimdPatch(image, windows.all, decay, scale * (x + 0.5f), scale * (y + 0.5f), &patch.all);
    if (ranks_) LoadSimdPatch(image, windows.sparse, decay, scale * (x + 0.5f), scale * (y + 0.5f), &patch.sparse);
    return patch;
  }

  // The cost of each source view . Returns how many windows it read.
  int Costs(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples samples,
            float* costs) const;

  int NumSamplesPerWindow(Samples samples) const {
    return samples == Samples::kAll ? window_.all.num_samples : window_.sparse.num_samples;
  }

 private:
  struct Level {
    PackedImage reference;
    std::vector<PackedImage> images;
    SimdSources sources;  // point into images
  };

  struct Windows {
    explicit Windows(const MatchingWindow& window) : all(window, Samples::kAll), sparse(window, Samples::kSparse) {}
    SimdWindow all, sparse;
  };

  const Windows& Window(WindowScale scale) const { return scale.near ? near_window_ : window_; }

  RayModel rays_;
  MatchingWindow matching_window_;
  Windows window_, near_window_;
  bool ranks_;  // by sparse samples
  std::vector<Level> levels_;
  Array2D<WindowScale> window_scales_;
};

}  // namespace phi
