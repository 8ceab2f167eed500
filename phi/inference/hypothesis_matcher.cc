#include "phi/inference/hypothesis_matcher.h"

#include <algorithm>

namespace phi {

HypothesisMatcher::HypothesisMatcher(const InferenceInput& input, const Hypotheses& hypotheses,
                                     const StereoOptions& stereo, Formulas formulas)
    : reference_{input.reference.image->view()}, maps_(hypotheses.maps()), formulas_(formulas) {
  const std::size_t num_views = std::min<std::size_t>(input.sources.size(), kMaxSourceViews);
  for (std::size_t j = 0; j < num_views; ++j) {
    sources_.push_back({input.sources[j].image->view()});
    views_.push_back(MakeRelativeView(input.reference.view->camera, input.sources[j].view->camera));
  }
  window_.samples_per_side = stereo.SamplesPerSide();
  window_.step = static_cast<float>(stereo.window_radius / window_.samples_per_side);
}

std::uint8_t HypothesisMatcher::Costs(int x, int y, float costs[kNumDirections]) const {
  std::uint8_t allowed = 0;
  const int num_views = static_cast<int>(views_.size());
  for (int k = 0; k < kNumDirections; ++k) {
    costs[k] = kMaxCost;
    if (!(maps_.inverse_depth[k](x, y) > 0)) continue;
    allowed |= static_cast<std::uint8_t>(1 << k);
    float view_costs[kMaxSourceViews];
    for (int j = 0; j < num_views; ++j) {
      view_costs[j] = HypothesisViewCost(reference_, sources_[j], views_[j], window_, maps_.inverse_depth[k], x, y);
    }
    std::uint32_t mask = 0;
    costs[k] = formulas_ == Formulas::kPaper ? HarmonicMeanCost(view_costs, num_views)
                                             : BestViewsCost(view_costs, num_views, &mask);
  }
  return allowed;
}

}  // namespace phi
