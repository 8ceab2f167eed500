// Inference on a measured map as it was judged: what few views saw carries no plane, and what is masked gets none.
#pragma once

#include "phi/backend.h"

namespace phi {

// As Backend::Infer, but unsure pixels of `input.measured` come back as measured, and those of `input.mask` end
// without depth. A surface that only one other image shows cannot be confirmed twice; but two views may share an error, and a
// plane that rests on it would carry it far. Throws as Backend::Infer.
InferenceResult InferHoles(Backend& backend, const InferenceInput& input, const StereoOptions& stereo,
                           const InferenceOptions& options);

}  // namespace phi
