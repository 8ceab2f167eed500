// The readable matcher: scalar code over 8-bit images. Reference for the vectorised one.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {

class ScalarMatcher {
 public:
  struct Patch {};

  ScalarMatcher(const EstimationInput& input, const EstimationParameters& parameters,
                const std::vector<RelativeView>& views)
      : parameters_(parameters), views_(views), reference_{input.reference.image->view()} {
    for (const ViewImage& source : input.sources) sources_.push_back({source.image->view()});
  }

  Patch LoadPatch(int, int) const { return {}; }

  // One cost per source view.
  void Costs(const Patch&, int x, int y, const PlaneHypothesis& h, float* costs) const {
    const float u = x + 0.5f, v = y + 0.5f;
    const Vec3f q = InverseDepthCoefficients(parameters_.reference, u, v, h);
    for (std::size_t j = 0; j < sources_.size(); ++j) {
      const GraySampler& source = sources_[j];
      costs[j] = ZnccCost(reference_, source, source.image.width, source.image.height, parameters_.window, u,
                          v, PlaneHomography(views_[j], q));
    }
  }

 private:
  const EstimationParameters& parameters_;
  const std::vector<RelativeView>& views_;
  GraySampler reference_;
  std::vector<GraySampler> sources_;
};

}  // namespace phi
