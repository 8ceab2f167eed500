// Pixels that have no texture of their own are not measured, whatever their window matched.
//
// On a plain wall beside a sofa a window's only contrast is the sofa's edge. It matches at the sofa's depth, and it does so in
// every view, so that the views confirm each other's error; and a wall's planes would rest on such pixels. Without them
// the planes of what surely was measured decide about the wall (paper section E). Nor is shading texture: a plane of
// brightness matches wherever it is laid.
#pragma once

#include "phi/base/images.h"
#include "phi/measurement.h"

namespace phi {

inline constexpr int kOwnTextureRadius = 2;  // pixels: 5 x 5 of them are the pixel's own surroundings
// Mean squared difference of the image, smoothed by 3 x 3 pixels, from a plane of brightness; squared grey levels. A
// sensor's noise loses nearly all of its variance in the smoothing, the faint texture of a sharp or of an enlarged photo
// does not.
inline constexpr double kMinOwnVariance = 0.125;
// White noise loses eight ninths of its variance in the smoothing, and leaves 0.467 of the last ninth about a plane of 5 x 5 such
// pixels: the trace of (1 - P) C / 25, where C is the smoothing's covariance and P projects onto planes. Of 100 pixels 8 have more
// than 0.8 of the ninth, so much is granted to noise: plain patches around them drop these as well.
inline constexpr double kNoiseShare = 0.8 / 9;

// Contrast that only touches the surroundings is another surface's: pixels so far around the middle of a plain patch of 5 x 5 are
// plain as well.
inline constexpr int kPlainReach = 1;

// Of each pixel; images smaller than the surroundings have no variance, and nothing in them is plain.
struct OwnTexture {
  Array2D<float> variance;  // squared grey levels
  Mask is_plain;            // not 0: less than kMinOwnVariance, or than noise makes, here or up to `plain_reach` pixels away
};

// `noise`: NoiseDeviation, grey levels. scale: of the limits below which a pixel is plain; plain_reach: pixels.
OwnTexture FindOwnTexture(const GrayImage& image, double noise, double scale = 1, int plain_reach = kPlainReach);

// Drops the plain pixels. The map has the image's size.
void DropPlainPixels(const OwnTexture& texture, MeasurementMap* map);

}  // namespace phi
