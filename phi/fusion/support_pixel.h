// The support rule of fusion for one pixel, as one would read it. support_run does the same operations in the same order for
// 16 pixels at once, and is what runs; a test compares the two to the bit.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/fusion/neighbor_lookup.h"

namespace phi {

// A pixel of the reference image and its ray, z = 1.
struct ReferencePixel {
  FusionPixel pixel;
  Vec3f ray;
  float fx = 1;  // of the reference camera
};

// What one image says about a reference pixel, in the order of the tests (neighbor_lookup.h).
enum class NeighborTest { kBlind, kOtherDepth, kOtherReprojection, kOtherNormal, kAgrees };

struct NeighborAnswer {
  NeighborTest test = NeighborTest::kBlind;
  bool covers = false;         // a point of its own stands for the pixel; the rest means nothing then
  bool sees_through = false;   // it measured a surface beyond the point
  float relative_depth = 0;    // of its plane along the reference ray, over the reference depth, minus 1
  float agreement = 0;         // [0, 1]: how well reprojection and normal agree
  Vec3f normal;                // reference frame
  FusionPixel pixel;           // what it holds there
};

NeighborAnswer AskNeighbor(const FusionNeighbor& neighbor, const FusionGates& gates, const ReferencePixel& reference);

// What the images make of a pixel together. Of a pixel without depth, or a covered one, only that is told.
struct PixelSupport {
  bool has_depth = false, is_covered = false;
  // Images by their answers; num_agreeing with the reference itself.
  int num_other_depth = 0, num_other_reprojection = 0, num_other_normal = 0, num_seen_through = 0, num_agreeing = 0;
  // The consensus: the median of the agreeing depths, and sums over those near it.
  float relative_depth = 0, support = 0;
  bool reference_is_near = false;
  int num_views = 0, num_inferred = 0;
  int rgb_sum[3] = {0, 0, 0};
  Vec3f normal_sum;                  // reference frame, weighted by agreement
  std::vector<std::uint32_t> views;  // neighbours near the consensus, by their place in the list
};

PixelSupport DecidePixel(const std::vector<FusionNeighbor>& neighbors, const FusionGates& gates,
                         const ReferencePixel& reference);

}  // namespace phi
