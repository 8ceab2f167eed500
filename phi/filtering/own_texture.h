// Pixels that have no texture of their own are not measured, whatever their window matched.
//
// On a plain wall beside a sofa a window's only contrast is the sofa's edge. It matches at the sofa's depth, and it does so in
// every view, so that the views confirm each other's error; and a wall's planes would rest on such pixels. Without them
// the planes of what surely was measured decide about the wall (paper section F).
#pragma once

#include "phi/backend.h"

namespace phi {

inline constexpr int kOwnTextureRadius = 2;  // pixels: 5 x 5 of them are the pixel's own surroundings
// Squared grey levels: of the order of what noise and 8 bits leave on a plain surface of a good photo.
inline constexpr int kMinOwnVariance = 1;

// Variance of the pixels around (x, y), those inside the image, at least kMinOwnVariance.
bool HasOwnTexture(ArrayView2D<const std::uint8_t> image, int x, int y);

// Takes the depth from the pixels without texture of their own. The map has the image's size.
void DropPlainPixels(const GrayImage& image, PlaneMap* map);

}  // namespace phi
