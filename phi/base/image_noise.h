// How noisy an image is.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"

namespace phi {

// Standard deviation of the noise in the image, grey levels; 0 where hardly any part of it is well exposed.
//
// A camera's noise is white, but JPEG takes most of what differs from pixel to pixel and leaves what differs over a few of them.
// So cells of 3 x 3 pixels tell, whose means have a third of white noise's deviation; and the quietest of them, since texture only
// adds.
double NoiseDeviation(ArrayView2D<const std::uint8_t> image);

}  // namespace phi
