// What the filter kept of an image's estimate, judged as measurements by the pixel's own texture. Only what stands here is
// published as measured, and tells of anything else. What else is probably right is a clue.
#pragma once

#include "phi/base/images.h"
#include "phi/base/rules.h"
#include "phi/geometry/depth_precision.h"
#include "phi/measurement.h"

namespace phi {

// Drops plain pixels, and what lies at the end of the search's range. What is dropped for being plain, or was by the filter, though it is
// probably right (confidence.h), becomes a clue.
//   image: the reference, grey; noise: its NoiseDeviation, grey levels; precision: of the reference's view;
//   farthest: depth at which the search ended (FarthestSearched), world units;
//   estimate: what the filter was given; map: what it returned.
void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision, float farthest,
                       const PlaneMap& estimate, MeasurementMap* map, const Rules& rules = {});

}  // namespace phi
