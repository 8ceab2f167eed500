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
// more with the coarser levels) while the matcher lives. LoadPatch, Rank, Score and Costs allocate nothing and may be called from many
// threads.
class SimdMatcher {
 public:
  struct Patch {
    WindowScale scale;
    Vec3f ray;  // of the pixel
    SimdPatch samples;
  };
  // What ranking found of a hypothesis.
  using Ranked = SimdSums;

  SimdMatcher(const EstimationInput& input, const EstimationParameters& parameters,
              const std::vector<RelativeView>& views);

  Patch LoadPatch(int x, int y) const {
    Patch patch;
    patch.scale = window_scales_(x, y);
    patch.ray = rays_.Ray(x + 0.5f, y + 0.5f);
    const float scale = 1.0f / static_cast<float>(1 << patch.scale.level);
    const float decay = WindowAtScale(matching_window_, patch.scale).weight_decay;
    const PackedImage& image = levels_[patch.scale.level].reference;
    LoadSimdPatch(image, Window(patch.scale), decay, scale * (x + 0.5f), scale * (y + 0.5f), &patch.samples);
    return patch;
  }

  // The cost of each source view by sparse samples; Score then gives that of all samples for the same hypothesis, and reads the others
  // alone. Each returns how many windows it read.
  int Rank(const Patch& patch, int x, int y, const PlaneHypothesis& h, Ranked* ranked, float* costs) const;
  int Score(const Patch& patch, Ranked* ranked, float* costs) const;
  // The cost of each source view. Returns how many windows it read.
  int Costs(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples samples, float* costs) const;

  int NumSamplesPerWindow(Samples samples) const { return window_.NumSamples(samples); }

 private:
  struct Level {
    PackedImage reference;
    std::vector<PackedImage> images;
    SimdSources sources;  // point into images
  };

  Array2D<WindowScale> SelectScales() const;
  const SimdWindow& Window(WindowScale scale) const { return scale.is_narrow ? narrow_window_ : window_; }
  void SumSparse(const Patch& patch, int x, int y, const PlaneHypothesis& h, Ranked* ranked) const;

  RayModel rays_;
  MatchingWindow matching_window_;
  SimdWindow window_, narrow_window_;
  std::vector<Level> levels_;
  Array2D<WindowScale> window_scales_;
};

}  // namespace phi
