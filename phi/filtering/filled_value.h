// The values of an inferred map's mask, from inference to the filter after it.
#pragma once

#include <cstdint>

#include "phi/base/hd.h"

namespace phi {

inline constexpr std::uint8_t kMeasuredPixel = 0;        // or a hole
inline constexpr std::uint8_t kInferredConfirmed = 255;  // some source view measured a depth that agrees
inline constexpr std::uint8_t kInferredAlone = 128;      // none did

// Views that must confirm a pixel.
PHI_HD int RequiredViews(std::uint8_t filled, int for_measured, int for_inferred) {
  return filled == kMeasuredPixel ? for_measured : for_inferred;
}

}  // namespace phi
