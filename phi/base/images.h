// The kinds of image that stages hand to each other.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"

namespace phi {

using GrayImage = Array2D<std::uint8_t>;
using CostMap = Array2D<float>;      // aggregated matching cost, [0, 2]
using Mask = Array2D<std::uint8_t>;  // 0 or 255
using ImageMask = Array2D<std::uint8_t>;  // of a photo; 0: left out, every other value: used

}  // namespace phi
