// What an image shows around a point, smoothed: noise falls to a fifth, and slopes of shade come out.
#pragma once

#include <optional>

#include "phi/base/images.h"

namespace phi {

struct BoxMean {
  float value = 0;       // grey levels
  float du = 0, dv = 0;  // its slopes, grey levels a pixel
};

// Of 5 x 5 pixels around image point (u, v), of which those at the sides count by the part that lies within. nullopt: they are not all
// in the image.
std::optional<BoxMean> MeanAround(const GrayImage& image, float u, float v);

}  // namespace phi
