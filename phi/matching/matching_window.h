// The window of the options, for estimation and inference alike.
#pragma once

#include "phi/matching/zncc.h"
#include "phi/options.h"

namespace phi {

// All samples count alike, and the scale is the same everywhere; estimation adds more (estimation_setup.cc).
inline MatchingWindow MakeMatchingWindow(const StereoOptions& options) {
  MatchingWindow window;
  window.samples_per_side = options.SamplesPerSide();
  window.step = static_cast<float>(options.window_step);
  return window;
}

}  // namespace phi
