// What the filter kept of an image's estimate, judged as measurements: by the pixel's own texture, by its neighbours, and by
// how many views could confirm it. Only what stands here is published as measured, and is evidence for anything else.
#pragma once

#include "phi/base/images.h"
#include "phi/geometry/depth_precision.h"
#include "phi/measurement.h"

namespace phi {

// Drops plain and contradicted pixels, and finds the doubtful ones (neighbor_agreement.h).
//   image: the reference, grey; noise: its NoiseDeviation, grey levels; precision: of the reference's view.
void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision, MeasurementMap* map);

}  // namespace phi
