// What both backends prepare before an estimation: plain parameters and relative views.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {

// Robust formulas: a sample's weight halves per 8 grey levels of difference from the window's centre.
inline constexpr float kSampleWeightDecay = 0.125f;

// Throws phi::InputError, naming the reference image, when the input cannot be estimated (no source view,
// more than kMaxSourceViews, an empty depth range).
EstimationParameters MakeEstimationParameters(const EstimationInput& input, const StereoOptions& options);

std::vector<RelativeView> MakeRelativeViews(const EstimationInput& input);

}  // namespace phi
