// The points that fusion makes of a block of rows.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/base/vec.h"
#include "phi/fusion/pixel_outcome.h"
#include "phi/fusion/point_confidence.h"
#include "phi/geometry/camera.h"

namespace phi {

struct FusedPoint {
  double xyz[3] = {0, 0, 0};    // world
  float normal[3] = {0, 0, 0};  // world, unit
  std::uint8_t rgb[3] = {0, 0, 0};
  std::uint8_t inferred : 1 = 0;    // 1: more of its measurements were inferred than measured
  std::uint8_t confidence : 7 = 0;  // per cent: how probable it is that the point is right (point_confidence.h); 0: not judged
};

// Points in pixel order. The views of point k are the next view_counts[k] entries of views, ascending.
struct FusedBlock {
  std::vector<FusedPoint> points;
  std::vector<std::uint32_t> view_counts;
  std::vector<std::uint32_t> views;
  std::vector<PointTerms> terms;  // of each point, where FusionOptions::keeps_terms
  OutcomeCounts outcomes;
};

// World units; points outside are dropped.
struct BoundingBox {
  double min[3], max[3];
};

// A point about to be written: position and normal in the reference frame, normal of any length.
struct PointCandidate {
  Vec3f point, normal;
  int rgb_sum[3] = {0, 0, 0};
  int num_views = 0, num_inferred = 0;
  int confidence = 0;  // per cent; 0: not judged
};

// Appends the point, in the frame of a camera of this pose, to `block`, whose last num_views views are the candidate's, in any
// order. kFused, or kOutsideBox, when those views are taken away. `box` may be null.
PixelOutcome EmitPoint(const Pose& pose, const BoundingBox* box, const PointCandidate& candidate,
                       FusedBlock* block);

}  // namespace phi
