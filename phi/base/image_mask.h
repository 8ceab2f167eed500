// Masks of what is left out of the reconstruction: people, cars, sky, turntables. A masked pixel has no depth and no
// brightness of its own; what the stages see in its place follows from the pixels around the mask alone.
#pragma once

#include <cstddef>

#include "phi/base/images.h"
#include "phi/base/whole_array.h"

namespace phi {

// All arguments of one call have the same size.

// For all that reads an image beside its mask: masked pixels take the brightness of a nearest used one, so that the mask has no
// edge. So do the source images of the matching, whose windows count the samples that the reference's window counts.
GrayImage ExtendIntoMask(const GrayImage& image, const ImageMask& mask);

// Of an image that is extended into the mask, for the reference image of the matching, and for regions: masked pixels are black or
// white, whichever is farther from a nearest used pixel. At 128 grey levels and more from a window's centre a sample has no weight
// (MatchingWindow::Weight), so that windows use what is outside the mask, and regions end at its edge. Not for matching without
// weights (the paper's).
GrayImage CutOutMask(const GrayImage& extended, const ImageMask& mask);

// Takes away what a map holds at masked pixels.
template <typename T>
void DropMasked(const ImageMask& mask, Array2D<T>* map) {
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (mask.data()[i] == 0) map->data()[i] = {};
    }
  });
}

}  // namespace phi
