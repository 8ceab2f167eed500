// Where two plain surfaces meet: what is measured there lies on both. What is measured elsewhere along a plain surface's border is
// the rim of a thing, which mostly stands before it: a picture's frame, a shelf.
#pragma once

#include <cstdint>

#include "phi/base/images.h"

namespace phi {

// Of each pixel of a region (ImageRegions::region) whether another one lies beside it, 255 or 0: within a 250th of the image's width, at
// least three pixels. What is said of pixels in no region means nothing.
Mask FindCreases(const Array2D<std::int32_t>& region);

}  // namespace phi
