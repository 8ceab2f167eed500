// The readable matcher: scalar code over 8-bit images. Reference for the vectorised one and for the GPU's.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/matching/estimate_pixel.h"
#include "phi/matching/pyramid.h"

namespace phi {

class ScalarMatcher {
 public:
  struct Patch {
    WindowScale scale;
  };

  ScalarMatcher(const EstimationInput& input, const EstimationParameters& parameters,
                const std::vector<RelativeView>& views)
      : parameters_(parameters), views_(views), reference_(Levels(*input.reference.image)) {
    for (const ViewImage& source : input.sources) sources_.push_back(Levels(*source.image));
    window_scales_ =
        SelectWindowScales(reference_[0], {reference_.begin() + 1, reference_.end()}, parameters.window);
  }

  Patch LoadPatch(int x, int y) const { return {window_scales_(x, y)}; }

  // The cost of each source view.
  void Costs(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples samples, float* costs) const {
    const float u = x + 0.5f, v = y + 0.5f;
    const int level = patch.scale.level;
    const float scale = 1.0f / static_cast<float>(1 << level);
    const MatchingWindow window = WindowAtScale(parameters_.window, patch.scale);
    const Vec3f q = InverseDepthCoefficients(parameters_.reference, u, v, h);
    const GraySampler reference{reference_[level].view()};
    for (std::size_t j = 0; j < sources_.size(); ++j) {
      const GraySampler source{sources_[j][level].view()};
      const Mat3f homography = ScaleHomography(PlaneHomography(views_[j], q), scale);
      costs[j] = ZnccCost(reference, source, window, {scale * u, scale * v}, homography, samples);
    }
  }

 private:
  std::vector<GrayImage> Levels(const GrayImage& image) const {
    std::vector<GrayImage> levels = BuildPyramid(image, parameters_.num_levels);
    levels.insert(levels.begin(), image);
    return levels;
  }

  const EstimationParameters& parameters_;
  const std::vector<RelativeView>& views_;
  std::vector<GrayImage> reference_;             // by level
  std::vector<std::vector<GrayImage>> sources_;  // by view and level
  Array2D<WindowScale> window_scales_;
};

}  // namespace phi
