// Coarse to fine: an estimation in parts, each at a level of the image pyramids. A part starts from the hypotheses of the
// coarser one before it (first_hypothesis.h). A window of a reduced image sees a larger piece of the surface and an
// iteration there costs a quarter or a sixteenth, so that few iterations are left to the full image.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {

// Iterations at one level: 2^-level of the size. They are counted as those of an estimation at full size, so that
// refinement ranges, in pixels of the level, go on about where the coarser part stopped.
struct EstimationPart {
  int level = 0;
  int first_iteration = 0, end_iteration = 0;
};

// Coarsest first; the last one is at level 0. One part alone in the paper's form, and where reduced images would be too
// small.
std::vector<EstimationPart> EstimationParts(const EstimationInput& input, const StereoOptions& options);

// The input, options and parameters of a part. Images stay as they are: each backend has its own pyramids.
class PartInput {
 public:
  PartInput(const EstimationInput& input, const StereoOptions& options, const EstimationPart& part);
  PartInput(const PartInput&) = delete;  // input() points to views_
  PartInput& operator=(const PartInput&) = delete;

  EstimationInput& input() { return input_; }
  const EstimationInput& input() const { return input_; }
  const StereoOptions& options() const { return options_; }
  EstimationParameters Parameters() const;

 private:
  const EstimationPart part_;
  std::vector<SceneView> views_;  // reduced: reference, then sources
  EstimationInput input_;
  StereoOptions options_;
};

}  // namespace phi
