// White noise of a depth map, which differs from pixel to pixel, and its removal before fusion. Averages over images alone
// remove little of it where few images see a spot; pixels beside each other measure the same surface.
//
// Depths are compared in inverse depth, which is linear over a plane's image, and carried from one pixel to the next by
// the mean of both pixels' slopes (from their normals), which is exact on curved surfaces to the second order.
#pragma once

#include "phi/fusion/fusion_pixel.h"
#include "phi/geometry/camera.h"

namespace phi {

// Standard deviation of the noise of the measured pixels, over their depth. 0 for a map with too few pixels to tell.
float EstimateNoise(const FusionMap& map, const Pinhole& pinhole);

// Moves each measured depth towards the mean of those around it that differ by noise alone, the less the more they
// differ beyond the noise (a Wiener filter). scale: of the difference from which on it is another surface.
void SmoothNoise(float noise, const Pinhole& pinhole, FusionMap* map, float scale = 1);

}  // namespace phi
