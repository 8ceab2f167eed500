// What both backends prepare before an inference.
#pragma once

#include "phi/backend.h"
#include "phi/inference/infer_pixel.h"
#include "phi/options.h"

namespace phi {

// Throws phi::InputError, naming the reference image, where its measured map is not there or has another size than the image.
void CheckInferenceInput(const InferenceInput& input);

InferenceParameters MakeInferenceParameters(const InferenceInput& input, const StereoOptions& stereo, const Method& method);

}  // namespace phi
