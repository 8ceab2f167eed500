// What a source view measured, as the reference image sees it.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/backend.h"
#include "phi/geometry/device_camera.h"
#include "phi/matching/cost_aggregation.h"

namespace phi {

// Every so many pixels in each direction, `least` or more, so that no more than `most` are taken.
inline int SamplingStep(int width, int height, int least, std::int64_t most) {
  const auto num_sampled = [&](std::int64_t step) {
    return ((width + step - 1) / step) * ((height + step - 1) / step);
  };
  int step = least;
  while (num_sampled(step) > most) ++step;
  return step;
}

// Of a row of pixels: (u, v) in K's coordinates. inverse_depth 0: the pixel is no anchor or lies behind the reference camera.
struct SourceAnchorRow {
  std::vector<float> u, v, inverse_depth;
};

class SourceAnchors {
 public:
  // `depths` outlives this.
  SourceAnchors(const ViewImage& source, const MeasuredDepths& depths, const Camera& reference)
      : depths_(depths),
        rays_(MakeRayModel(source.view->camera.pinhole)),
        reference_from_source_(MakeRelativeView(source.view->camera, reference)) {}

  // Of every `step`th pixel of row y.
  void FindRow(int y, int step, SourceAnchorRow* row) const;

 private:
  const MeasuredDepths& depths_;
  RayModel rays_;
  RelativeView reference_from_source_;
};

}  // namespace phi
