#include "phi/cpu/simd_matcher.h"

namespace phi {

SimdMatcher::SimdMatcher(const EstimationInput& input, const EstimationParameters& parameters,
                         const std::vector<RelativeView>& views)
    : rays_(parameters.reference), window_(parameters.window), reference_(*input.reference.image) {
  images_.reserve(input.sources.size());  // sources_ points into them
  for (std::size_t j = 0; j < input.sources.size(); ++j) {
    images_.emplace_back(*input.sources[j].image);
    sources_.emplace_back(images_[j], views[j]);
  }
}

void SimdMatcher::Costs(const Patch& patch, int x, int y, const PlaneHypothesis& h, float* costs) const {
  const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
  const float scale = 1.0f / (h.depth * Dot(h.normal, rays_.Ray(u, v)));
  const PlaneAtPixel plane = {1.0 / h.depth, scale * h.normal.x / rays_.fx, scale * h.normal.y / rays_.fy};
  SimdZnccCosts(window_, sources_, patch, u, v, plane, costs);
}

}  // namespace phi
