// Splits space into boxes that hold a limited number of points of two clouds, so that a search structure is
// built for one box at a time: clouds of 10^8 points need no tree of 10^8 points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "phi/base/vec.h"

namespace colmap_ext {

struct Box {
  phi::Vec3f lower, upper;
};

// Indices [begin, end) into SpaceBlocks::query_order and reference_order.
struct SpaceBlock {
  Box box;
  std::size_t query_begin = 0, query_end = 0;
  std::size_t reference_begin = 0, reference_end = 0;
};

struct SpaceBlocks {
  std::vector<std::uint32_t> query_order, reference_order;
  std::vector<SpaceBlock> blocks;

  // The reference points in the block's box grown by `margin` on all sides.
  std::vector<phi::Vec3f> ReferencesAround(std::size_t block, const std::vector<phi::Vec3f>& references,
                                           float margin) const;
};

struct SpaceBlockOptions {
  std::size_t max_points = 500000;  // of both clouds together in one block
  float min_side = 0;               // world units; a block this small is not split however many points it has
};

SpaceBlocks SplitIntoBlocks(const std::vector<phi::Vec3f>& queries, const std::vector<phi::Vec3f>& references,
                            const SpaceBlockOptions& options);

}  // namespace colmap_ext
