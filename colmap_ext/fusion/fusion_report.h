// Tells in words what became of the pixels, and the likely cause when few or no points came out.
#pragma once

#include <string>

#include "colmap_ext/fusion/scene_fusion.h"

namespace colmap_ext {

// One line a reason with its share of all pixels, most frequent first.
std::string OutcomeHistogram(const phi::OutcomeCounts& outcomes);

// How many maps were smoothed, and how noisy they were; "" if none.
std::string DescribeSmoothing(const SceneFusionReport& report);

// Empty when the number of points is plausible; else one sentence with the likely cause and what to do.
std::string ExplainFewPoints(const SceneFusionReport& report);

// Points, images, seconds and what became of the pixels, for the file beside the cloud that the report page reads.
std::string FusionJson(const SceneFusionReport& report, double seconds);

}  // namespace colmap_ext
