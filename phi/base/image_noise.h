// How noisy an image is.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"

namespace phi {

// Standard deviation of the white noise in the image, grey levels, about a tenth too low; 0 where hardly any part of it
// is well exposed.
//
// A second difference in both directions, which planes of brightness do not have, of white noise has 6 times its standard
// deviation. Texture only adds to it, so that the least textured tenth of the image's blocks tells.
double NoiseDeviation(ArrayView2D<const std::uint8_t> image);

}  // namespace phi
