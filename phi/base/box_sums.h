// Sums over small boxes of an image: smoothing without rounding.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"

namespace phi {

// Of the 3 x 3 pixels around each; the border's pixels count again beyond it. Nine times a smoothed grey level.
Array2D<std::uint16_t> SumBoxes3x3(ArrayView2D<const std::uint8_t> image);

// The same twice over: 81 times a grey level that was smoothed twice.
Array2D<std::uint16_t> SumBoxes3x3Twice(ArrayView2D<const std::uint8_t> image);

}  // namespace phi
