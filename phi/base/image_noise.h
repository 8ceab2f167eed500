// How noisy an image is.
#pragma once

#include <cstdint>
#include <functional>

#include "phi/base/array2d.h"

namespace phi {

inline constexpr int kNoiseBlock = 16;  // pixels on a side

// What of_block(x0, y0) says of the block of pixels from (x0, y0) on, for the block below which a tenth of the well exposed ones lie:
// texture only adds to noise, so that the quietest tell of it. 0 where hardly any part of the image is well exposed. Blocks do not
// touch the image's border; of_block is called from several threads.
double OfQuietBlocks(ArrayView2D<const std::uint8_t> image, const std::function<double(int x0, int y0)>& of_block);

// Standard deviation of the white noise in the image, grey levels, about a tenth too low; 0 where hardly any part of it
// is well exposed.
//
// A second difference in both directions, which planes of brightness do not have, of white noise has 6 times its standard
// deviation. The quietest blocks tell.
double NoiseDeviation(ArrayView2D<const std::uint8_t> image);

}  // namespace phi
