// What the filter kept of an image's estimate, judged as measurements by the pixel's own texture. Only what stands here is
// published as measured, and tells of anything else. What else is probably right is a clue.
#pragma once

#include "phi/base/images.h"
#include "phi/filtering/judge_pixel.h"
#include "phi/filtering/judgement.h"
#include "phi/measurement.h"

namespace phi {

// Without what is an array of pixels or of views.
JudgementReference MakeJudgementReference(const Judgement& judgement);

// Drops plain pixels, and what lies at the end of the search's range. What is dropped for being plain, or was by the filter, though it is
// probably right (confidence_terms.h), becomes a clue.
//   estimate: what the filter was given; testimonies: of its pixels; map: what the filter kept.
void JudgeMeasurements(const Judgement& judgement, const PlaneMap& estimate, const Array2D<Testimonies>& testimonies, MeasurementMap* map);

}  // namespace phi
