// Two surfaces of one colour that meet where the edge between them has faded are one even area of the image; but the way through is
// narrow there.
#pragma once

#include <cstdint>

#include "phi/base/images.h"
#include "phi/inference/image_regions.h"

namespace phi {

// `inside`: of even areas; `wide`: those of its pixels that lie far enough from its border (0 or 255). Areas that hold several cores,
// `min_core_size` connected pixels of `wide` at least, are parted: each pixel goes to the core that is nearest on the way through the area
// (four neighbours; of two as near to one of them, always the same). Others are one region each.
ImageRegions PartAtNecks(const Mask& inside, const Mask& wide, std::int64_t min_core_size);

}  // namespace phi
