// What both backends prepare before an inference.
#pragma once

#include "phi/backend.h"
#include "phi/inference/infer_pixel.h"
#include "phi/options.h"

namespace phi {

// Throws phi::InputError, naming the image, where the reference's measured map is not there, or it or a source's depths have another size
// than their image.
void CheckInferenceInput(const InferenceInput& input);

InferenceParameters MakeInferenceParameters(const InferenceInput& input, const StereoOptions& stereo, const Method& method);

}  // namespace phi
