// What the filter kept of an image's estimate, judged as measurements by the pixel's own texture. Only what stands here is
// published as measured, and tells of anything else. What else is probably right is a clue.
#pragma once

#include <limits>
#include <memory>

#include "phi/base/images.h"
#include "phi/base/rules.h"
#include "phi/filtering/judge_pixel.h"
#include "phi/geometry/depth_precision.h"
#include "phi/measurement.h"

namespace phi {

struct Judgement {
  std::shared_ptr<const GrayImage> image;  // the reference
  double noise = 0;                        // its NoiseDeviation, grey levels
  DepthPrecision precision;                // of the reference's view
  float farthest = std::numeric_limits<float>::infinity();  // depth at which the search ended (FarthestSearched), world units
  Rules rules = {};
};

// Without what is an array of pixels or of views.
JudgementReference MakeJudgementReference(const Judgement& judgement);

// Drops plain pixels, and what lies at the end of the search's range. What is dropped for being plain, or was by the filter, though it is
// probably right (confidence_terms.h), becomes a clue.
//   estimate: what the filter was given; map: what it returned.
void JudgeMeasurements(const Judgement& judgement, const PlaneMap& estimate, MeasurementMap* map);

}  // namespace phi
