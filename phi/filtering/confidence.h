// The confidence terms of all pixels of an estimate, in vector instructions.
#pragma once

#include <functional>

#include "phi/base/array2d.h"
#include "phi/base/images.h"
#include "phi/filtering/confidence_terms.h"
#include "phi/geometry/device_camera.h"
#include "phi/measurement.h"

namespace phi {

// What the terms are found from. All arrays have one size.
struct ConfidenceInput {
  const RayModel& rays;  // of the estimate's view
  const PlaneMap& estimate;
  const Array2D<Testimonies>& testimonies;
  const Mask& wanted;                  // 0: not
  const Array2D<float>& deviations;    // DepthPrecision::RelativeDeviations of the estimate, where wanted
  const Array2D<float>& own_variance;  // of the photo, see own_texture.h
  double noise = 0;                    // of the photo: NoiseDeviation, grey levels
};

// Calls function(x, y, terms) for each wanted pixel of the estimate that has depth, from several threads.
void ForConfidenceTerms(const ConfidenceInput& input,
                        const std::function<void(int x, int y, const ConfidenceTerms& terms)>& function);

}  // namespace phi
