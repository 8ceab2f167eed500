// Plane hypothesis inference (the paper's section E) on the CPU: hypotheses along four directions, their matching
// cost, a Markov random field that chooses, normals. Geometric consistency afterwards decides what stays.
#pragma once

#include "phi/backend.h"

namespace phi {

// What is evidence comes out unchanged. All else is filled where a hypothesis was chosen.
InferenceResult InferPlanes(const InferenceInput& input, const StereoOptions& stereo,
                            const InferenceOptions& options);

}  // namespace phi
