// How precisely matching can tell a depth: a fraction of a pixel in the source views, carried back to the reference's ray.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "phi/base/array2d.h"
#include "phi/base/images.h"
#include "phi/geometry/camera.h"
#include "phi/geometry/device_camera.h"
#include "phi/geometry/match_motion.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {

class DepthPrecision {
 public:
  // Where no source view sees a point its deviation is 0: nothing is known of it.
  DepthPrecision() = default;
  DepthPrecision(const RayModel& reference, std::vector<RelativeView> sources)
      : reference_(reference), sources_(std::move(sources)) {}
  DepthPrecision(const Camera& reference, const std::vector<const Camera*>& sources);

  const RayModel& reference() const { return reference_; }
  const std::vector<RelativeView>& sources() const { return sources_; }

  // Of a depth (or an inverse depth), relative to it, at (u, v) of the reference image, K's coordinates. As one source
  // view tells it: a typical one of those whose images contain the point, by the root mean square of how far the point
  // moves in them when its depth changes.
  float RelativeDeviation(float u, float v, float depth) const;
  // The same of `size` points.
  void FindRelativeDeviations(const float* u, const float* v, const float* depth, std::size_t size, float* deviations) const;
  // Of the pixels of a map of the reference that are wanted (not 0); 0 elsewhere, and where there is no depth.
  Array2D<float> RelativeDeviations(const PlaneMap& map, const Mask& wanted) const;

 private:
  RayModel reference_;
  std::vector<RelativeView> sources_;
};

}  // namespace phi
