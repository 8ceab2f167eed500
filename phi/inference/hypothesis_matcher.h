// Matching costs of the hypotheses of one image.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/backend.h"
#include "phi/inference/hypotheses.h"
#include "phi/inference/hypothesis_cost.h"

namespace phi {

// References `input` and `hypotheses`; both must outlive it. Safe for concurrent calls.
class HypothesisMatcher {
 public:
  HypothesisMatcher(const InferenceInput& input, const Hypotheses& hypotheses, const StereoOptions& stereo,
                    Formulas formulas);

  // Aggregated cost of each of the pixel's hypotheses; returns the mask of those that exist, and leaves the others'
  // costs at kMaxCost.
  std::uint8_t Costs(int x, int y, float costs[kNumDirections]) const;

 private:
  GraySampler reference_;
  std::vector<GraySampler> sources_;
  std::vector<RelativeView> views_;
  MatchingWindow window_;
  HypothesisMaps maps_;
  Formulas formulas_;
};

}  // namespace phi
