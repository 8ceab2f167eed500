// Whether the source images show a spot of the reference image as bright where a plane would put it. On an even wall windows tell
// no depth; but where a wrong plane lands on a bookcase, the brightness is another.
#pragma once

#include <span>
#include <vector>

#include "phi/backend.h"
#include "phi/geometry/device_camera.h"
#include "phi/inference/spot.h"

namespace phi {

class SpotViews {
 public:
  // `gains`: the reference's brightness over each source's. `input` outlives this.
  SpotViews(const InferenceInput& input, std::span<const float> gains);

  // Of the source views that show the spot's point at inverse depth w, the share with another brightness there; 0: none shows
  // it. A view that measured something else at the place tells nothing: the point is hidden there, or the measurement is wrong.
  // w = 0: infinitely far, as the sky is. 1 below, which is no depth.
  double Unlike(const Spot& spot, double w) const;

 private:
  struct Source {
    RelativeView view;
    const GrayImage* image;
    const MeasuredDepths* depths;  // null: unknown
    float gain;
  };

  const GrayImage* reference_;
  std::vector<Source> sources_;
};

}  // namespace phi
