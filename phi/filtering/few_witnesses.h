// Pixels that few views could see, all of which confirm them: measured, and published so, but no evidence for anything else.
//
// A surface that only one other image shows cannot be confirmed twice. But two views may share an error, and a plane that
// rests on it would carry it far: inference works without these pixels, and they come back after it.
#pragma once

#include "phi/backend.h"

namespace phi {

// Takes the depth from the pixels where `few_witnesses` is not 0. Both have one size.
void HideFewWitnesses(const Mask& few_witnesses, PlaneMap* map);
void HideFewWitnesses(const Mask& few_witnesses, DepthMap* depths);

// Puts the pixels of `measured` with few witnesses back in the place of what was inferred there.
void RestoreFewWitnesses(const PlaneMap& measured, const Mask& few_witnesses, InferenceResult* inferred);

}  // namespace phi
