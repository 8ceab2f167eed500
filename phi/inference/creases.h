// Where two plain surfaces meet: what is measured there lies on both. What is measured elsewhere along a plain surface's border is
// the rim of a thing, which mostly stands before it: a picture's frame, a shelf.
#pragma once

#include <cstdint>

#include "phi/inference/image_regions.h"

namespace phi {

// Whether another region lies beside (x, y), a pixel of region `own` or beside it: within a 250th of the image's width, at least
// three pixels.
bool IsAtCrease(const ImageRegions& regions, std::int32_t own, int x, int y);

}  // namespace phi
