// Inference on a measured map as it was judged: what few views saw carries no plane, and what is masked gets none.
#pragma once

#include "phi/backend.h"

namespace phi {

// `input.measured` holds every pixel that was judged; those marked in `few_witnesses` are hidden from the backend and come
// back as measured. Pixels of `input.mask` end without depth. Throws as Backend::Infer.
InferenceResult InferHoles(Backend& backend, InferenceInput input, const Mask& few_witnesses, const StereoOptions& stereo,
                           const InferenceOptions& options);

}  // namespace phi
