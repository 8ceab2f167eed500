// What an estimate's pixels are judged by (judge_measurements.h).
#pragma once

#include <limits>
#include <memory>

#include "phi/base/images.h"
#include "phi/base/rules.h"
#include "phi/geometry/depth_precision.h"

namespace phi {

struct Judgement {
  std::shared_ptr<const GrayImage> image;  // the reference
  double noise = 0;                        // its NoiseDeviation, grey levels
  DepthPrecision precision;                // of the reference's view
  float farthest = std::numeric_limits<float>::infinity();  // depth at which the search ended (FarthestSearched), world units
  Rules rules = {};
};

}  // namespace phi
