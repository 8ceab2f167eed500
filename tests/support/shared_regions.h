// An image's regions, as what finds their planes takes them.
#pragma once

#include <memory>

#include "phi/inference/image_regions.h"

namespace phi {

inline std::shared_ptr<const ImageRegions> SharedRegions(const GrayImage& image, const Rules& rules = {}) {
  return std::make_shared<const ImageRegions>(FindRegions(image, rules));
}

}  // namespace phi
