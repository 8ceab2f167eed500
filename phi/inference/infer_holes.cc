#include "phi/inference/infer_holes.h"

namespace phi {
InferenceResult InferHoles(Backend& backend, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options) {
  InferenceResult inferred = backend.Infer(input, stereo, options);
  if (input.mask != nullptr) DropMasked(*input.mask, &inferred.map);
  return inferred;
}

}  // namespace phi
