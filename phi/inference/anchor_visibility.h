// Which of the points that other views measured the reference image can see. Their brightness alone does not tell: of a
// white wall behind a white sofa it would make anchors of the sofa.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/geometry/device_camera.h"
#include "phi/inference/pooled_anchors.h"

namespace phi {

// References `input`, which must outlive it. Safe for concurrent calls.
class Surroundings {
 public:
  explicit Surroundings(const InferenceInput& input, const Rules& rules = {});

  // Whether what the reference measured around pixel (x, y) hides a point there. The nearest measured pixels to the left, to
  // the right, above and below continue over (x, y) along their planes, but where the source views see through them, as
  // through a window. The point is hidden where at least two pass before it, and more of them than do not. Rooms are hollow: a
  // wall continued past a corner runs behind what is seen there.
  bool Hide(int x, int y, float inverse_depth) const;

 private:
  float ContinuedDepth(int x, int y, int dx, int dy) const;
  bool IsSeenThrough(int x, int y, float inverse_depth) const;

  RayModel rays_;
  const MeasurementMap& measured_;
  const Rules rules_;
  std::vector<RelativeView> views_;
  std::vector<MeasuredDepthsView> source_depths_;  // parallel to views_
};

// Takes away the points that others hide: of those that land in the same few pixels, all beyond a gap in depth that at least
// three stand before. `step`: the pixels that the views were sampled at are so far apart.
void RemoveHidden(int width, int height, int step, std::vector<PooledAnchor>* pooled,
                  const Rules& rules = {});

}  // namespace phi
