// The support rule of fusion for a run of pixels of one row at once: where do the images that agree with a pixel put the
// surface, and do they agree well enough? The depth is the median, which on real maps is more accurate than weighted means;
// support is the sum of the other images' agreements, so that one image in close agreement counts as much as several that
// just pass. support_pixel.h is the same rule to read, for one pixel.
//
// A run is 16 pixels whatever the processor's vectors hold. Pixels are independent and every operation is the same
// IEEE one in all instruction sets, so that results do not depend on the processor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "phi/fusion/neighbor_lookup.h"

namespace phi {

inline constexpr int kRunLength = 16;

// Bit i: pixel i of the run.
using RunBits = std::uint32_t;

// Pixels [x, x + kRunLength) of a row of the reference; those beyond the row have depth 0.
struct ReferenceRun {
  alignas(64) float depth[kRunLength];
  alignas(64) float ray_x[kRunLength];
  alignas(64) std::uint32_t normal[kRunLength];  // PackedNormal's bits
  alignas(64) std::uint32_t color[kRunLength];   // rgb and flags, as in FusionPixel
  float ray_y = 0;
  float fx = 1;  // of the reference camera
};

// What one image says about the pixels of a run. Valid where it agrees.
struct RunAnswer {
  // Of the image's plane along the reference ray, over the reference depth, minus 1.
  alignas(64) float relative_depth[kRunLength];
  // [0, 1]: how well reprojection and normal agree.
  alignas(64) float agreement[kRunLength];
  alignas(64) float normal[3][kRunLength];  // in the reference frame
  alignas(64) std::uint32_t color[kRunLength];
  RunBits agrees = 0;  // after the consensus: belongs to the point
};

// Results for the pixels that no earlier image covers, and the memory that runs share.
struct SupportRun {
  explicit SupportRun(const std::vector<FusionNeighbor>& neighbors);

  RunBits has_depth = 0;
  RunBits covered = 0;  // by a point of an earlier image

  // Images whose answer is no agreement, by the test that failed (NeighborTest in support_pixel.h).
  alignas(64) std::int32_t num_without_depth[kRunLength];
  alignas(64) std::int32_t num_depth[kRunLength], num_reprojection[kRunLength], num_normal[kRunLength];
  alignas(64) std::int32_t num_seen_through[kRunLength], num_hidden[kRunLength];  // among num_depth
  alignas(64) std::int32_t num_agreeing[kRunLength];      // the reference included

  // Consensus.
  alignas(64) float relative_depth[kRunLength];
  alignas(64) float support[kRunLength];           // sum of the other images' agreements, depth included
  alignas(64) std::int32_t num_views[kRunLength];  // that agree with the consensus, the reference included
  alignas(64) std::int32_t num_inferred[kRunLength];
  alignas(64) std::int32_t rgb_sum[3][kRunLength];
  alignas(64) std::int32_t brightness_squares[kRunLength];  // sum of (red + green + blue)^2
  alignas(64) float normal_sum[3][kRunLength];  // reference frame, weighted by agreement
  alignas(64) float least_cosine[kRunLength];   // between the reference's ray to the point and another image's
  RunAnswer reference;
  std::vector<RunAnswer> answers;  // by neighbour

  struct Lanes {
    alignas(64) float value[kRunLength];
  };
  std::vector<Lanes> sorted;            // relative depths, for the median
  std::vector<std::uint32_t> agreeing;  // neighbours that agree somewhere in the run
  // Earlier neighbours, those first that covered something last: they are likely to cover the next pixels too.
  // The order saves time and changes no result.
  std::vector<std::uint32_t> earlier;
};

// Fills `run`. `neighbors` as `run` was made for.
void DecideRun(const std::vector<FusionNeighbor>& neighbors, const FusionGates& gates,
               const ReferenceRun& reference, SupportRun* run);

}  // namespace phi
