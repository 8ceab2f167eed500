// What the filter kept of an image's estimate, judged as measurements: by the pixel's own texture, by its neighbours, and by
// how many views could confirm it. Only what stands here is published as measured, and is evidence for anything else.
#pragma once

#include <memory>

#include "phi/backend.h"
#include "phi/geometry/depth_precision.h"

namespace phi {

// Takes the depth from plain and contradicted pixels, and makes that of doubtful ones negative (neighbor_agreement.h). A
// doubtful pixel with few witnesses is not even a clue, and loses its depth too.
//   image: the reference, grey; noise: its NoiseDeviation, grey levels; precision: of the reference's view.
void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision, FilterResult* filtered);

// The map without its doubtful pixels; itself where it has none.
std::shared_ptr<const PlaneMap> WithoutDoubtful(std::shared_ptr<const PlaneMap> map);

}  // namespace phi
