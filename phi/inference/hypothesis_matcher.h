// Matching costs of the hypotheses of one image.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/backend.h"
#include "phi/inference/hypotheses.h"
#include "phi/inference/hypothesis_cost.h"

namespace phi {

// References `input` and `hypotheses`; both must outlive it. Safe for concurrent const calls, each thread with its own
// Scratch.
class HypothesisMatcher {
 public:
  HypothesisMatcher(const InferenceInput& input, const Hypotheses& hypotheses, const StereoOptions& stereo,
                    Formulas formulas);

  // Per sample of the window, row by row, padded to a multiple of kLanes.
  struct Scratch {
    std::vector<float> reference, inverse_depth, u, v, source;
  };

  // Aggregated cost of each of the pixel's hypotheses, and which of them may be chosen; the others' costs mean nothing.
  PixelHypotheses Costs(int x, int y, Scratch* scratch) const;
  // What the source views measured where this depth of pixel (x, y) would be.
  DepthEvidence Evidence(int x, int y, float inverse_depth) const;

 private:
  // Of hypothesis k, aggregated. After SampleReference.
  float Cost(int x, int y, int k, Scratch* scratch) const;
  void SampleReference(int x, int y, Scratch* scratch) const;
  void SampleMap(ArrayView2D<const float> inverse_depth, int x, int y, Scratch* scratch) const;
  // The same value as HypothesisViewCost, up to the order of its sums.
  float ViewCost(int view, int x, int y, Scratch* scratch) const;
  bool ProjectWindow(const RelativeView& view, int x, int y, Scratch* scratch) const;

  GraySampler reference_;
  std::vector<GraySampler> sources_;
  std::vector<RelativeView> views_;
  std::vector<MeasuredDepthsView> source_depths_;  // parallel to views_; no data: unknown
  MatchingWindow window_;
  std::vector<float> offset_u_, offset_v_;  // of the samples from the window's centre, pixels
  const Hypotheses& hypotheses_;
  Formulas formulas_;
};

}  // namespace phi
