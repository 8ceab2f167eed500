#pragma once

#include <bit>
#include <cstdint>

#include "phi/base/hd.h"

namespace phi {

// The cube root of a positive normal number, within 3e-5 of itself. A third of the bits is near it (the constant puts the largest
// error of 3 % on both sides); one step of Halley's method does the rest.
PHI_HD float CubeRoot(float x) {
  const float y = std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) / 3u + 0x2a510000u);
  const float cube = y * y * y;
  return y * ((cube + 2 * x) / (2 * cube + x));
}

}  // namespace phi
