// Inference on a measured map as it was judged: what is masked gets no depth, and nothing one outside the range.
#pragma once

#include "phi/backend.h"

namespace phi {

// As Backend::Infer, but the pixels of `input.mask` end without depth, and so do those inferred nearer than `input.nearest` or
// farther than `input.farthest`. Throws as Backend::Infer.
InferenceResult InferHoles(Backend& backend, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options);

}  // namespace phi
