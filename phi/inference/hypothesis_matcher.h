// Matching costs of the hypotheses of one image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "phi/backend.h"
#include "phi/inference/hypotheses.h"
#include "phi/inference/infer_pixel.h"

namespace phi {

// References `input` and `hypotheses`; both must outlive it. Safe for concurrent const calls, each thread with its own
// Context.
class HypothesisMatcher {
 public:
  HypothesisMatcher(const InferenceInput& input, const Hypotheses& hypotheses, const StereoOptions& stereo,
                    const Method& method);

  class Context;

 private:
  // Per sample of the window, row by row, padded to a multiple of kLanes.
  struct Scratch {
    explicit Scratch(std::size_t n)
        : reference(n), inverse_depth(n), u(n), v(n), fu(n), fv(n), source(n), above(n), below(n) {}
    std::vector<float> reference, inverse_depth, u, v, fu, fv, source;
    std::vector<std::int32_t> above, below;
  };

  void SampleReference(int x, int y, Scratch* scratch) const;
  void SampleMap(ArrayView2D<const float> inverse_depth, int x, int y, Scratch* scratch) const;
  static void SampleGray(ArrayView2D<const std::uint8_t> image, float shift, int num_samples, Scratch* scratch,
                         float* samples);
  // The same value as HypothesisViewCost, up to the order of its sums.
  float ViewCost(int view, int x, int y, Scratch* scratch) const;

  GraySampler reference_;
  std::vector<GraySampler> sources_;
  std::vector<RelativeView> views_;
  std::vector<MeasuredDepthsView> source_depths_;  // parallel to views_; no data: unknown
  std::vector<float> offset_u_, offset_v_;         // of the samples from the window's centre, pixels
  InferenceParameters parameters_;
  HypothesisState state_;
};

// The view policy of infer_pixel.h; one for each thread.
class HypothesisMatcher::Context {
 public:
  struct Patch {};

  explicit Context(const HypothesisMatcher& matcher)
      : parameters(matcher.parameters_),
        state(matcher.state_),
        reference(matcher.reference_),
        matcher_(matcher),
        scratch_(matcher.offset_u_.size()) {}

  const RelativeView& View(int j) const { return matcher_.views_[j]; }
  const MeasuredDepthsView& Depths(int j) const { return matcher_.source_depths_[j]; }
  Patch LoadPatch(int x, int y) const {
    matcher_.SampleReference(x, y, &scratch_);
    return {};
  }
  void Costs(const Patch&, int x, int y, int k, float* costs) const {
    matcher_.SampleMap(state.maps.inverse_depth[k], x, y, &scratch_);
    for (int j = 0; j < parameters.num_views; ++j) costs[j] = matcher_.ViewCost(j, x, y, &scratch_);
  }

  const InferenceParameters& parameters;
  const HypothesisState& state;
  const GraySampler& reference;

 private:
  const HypothesisMatcher& matcher_;
  mutable Scratch scratch_;
};

}  // namespace phi
