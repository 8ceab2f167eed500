#include "colmap_ext/compact_codes.h"

#include "colmap_ext/plane_channels.h"
#include "phi/base/wide_vectors.h"

namespace colmap_ext {
namespace compact {
namespace {

// The finest steps that reach from the least depth to the largest.
BlockScale ScaleOf(std::uint32_t least, std::uint32_t largest) {
  BlockScale scale{least, 0};
  while (StepOf(scale, largest) > kMaxStep) {
    ++scale.shift;
    scale.base = least >> scale.shift << scale.shift;  // so that depths once rounded are steps of any finer scale
  }
  return scale;
}

// As NormalOf(CodeOf(normal)), of `size` normals.
PHI_WIDE_VECTORS void RoundNormals(float* x, float* y, float* z, int size) {
  for (int i = 0; i < size; ++i) {
    const phi::Vec3f rounded = NormalOf(CodeOf({x[i], y[i], z[i]}));
    x[i] = rounded.x;
    y[i] = rounded.y;
    z[i] = rounded.z;
  }
}

// Of depths in one block.
PHI_WIDE_VECTORS void RoundDepths(BlockScale scale, float* depth, int size) {
  for (int i = 0; i < size; ++i) depth[i] = DepthAt(scale, StepOf(scale, BitsOf(depth[i])));
}

}  // namespace

std::vector<BlockScale> ScalesOf(const phi::MeasurementMap& map, const Grid& grid) {
  std::vector<BlockScale> scales(grid.num_blocks());
  tbb::parallel_for(std::size_t{0}, scales.size(), [&](std::size_t b) {
    std::uint32_t least = std::numeric_limits<std::uint32_t>::max(), largest = 0;
    grid.ForPixelsOf(static_cast<int>(b), [&](std::size_t i) {
      if (!HasDepth(map, i)) return;
      const std::uint32_t bits = BitsOf(map.planes.data()[i].depth);
      least = std::min(least, bits);
      largest = std::max(largest, bits);
    });
    if (largest > 0) scales[b] = ScaleOf(least, largest);
  });
  return scales;
}

}  // namespace compact

phi::MeasurementMap RoundToCompact(phi::MeasurementMap map) {
  const compact::Grid grid{map.width(), map.height()};
  const std::vector<compact::BlockScale> scales = compact::ScalesOf(map, grid);
  tbb::parallel_for(0, map.height(), [&](int y) {
    const int width = map.width();
    PlaneChannels row(static_cast<std::size_t>(width));
    row.Load(&map.planes(0, y), static_cast<std::size_t>(width));
    compact::RoundNormals(row.x.data(), row.y.data(), row.z.data(), width);
    const compact::BlockScale* scale =
        &scales[static_cast<std::size_t>(y / compact::kBlock) * static_cast<std::size_t>(grid.columns())];
    for (int x = 0; x < width; x += compact::kBlock)
      compact::RoundDepths(*scale++, &row.depth[x], std::min(compact::kBlock, width - x));
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    for (int x = 0; x < width; ++x) {
      if (compact::HasDepth(map, first + static_cast<std::size_t>(x))) {
        map.planes(x, y) = {{row.x[x], row.y[x], row.z[x]}, row.depth[x]};
      } else {
        map.planes(x, y) = {};
        if (!map.states.empty()) map.states(x, y) = phi::PixelState::kNone;
      }
    }
  });
  map.testimonies = {};
  return map;
}

}  // namespace colmap_ext
