// What both backends prepare before an estimation: plain parameters and relative views.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {

// Robust formulas: the difference from the window's centre, in grey levels, at which a sample counts half.
inline constexpr float kHalfWeightDifference = 9.0f;

// Throws phi::InputError, naming the reference image, when the input cannot be estimated (no source view,
// more than kMaxSourceViews, an empty depth range).
void CheckEstimationInput(const EstimationInput& input);

// How far hypotheses may lie; depth_max: where the view's range ends, which the user gave or not. World units.
float FarthestSearched(float depth_max, bool depth_range_is_given, const Method& method);

// Of all iterations. Checks the input, too.
EstimationParameters MakeEstimationParameters(const EstimationInput& input, const StereoOptions& options);

std::vector<RelativeView> MakeRelativeViews(const EstimationInput& input);

}  // namespace phi
