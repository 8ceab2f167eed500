// The whole numbers by which a compact map (compact_map.h) holds depths and normals, and a map as they give it back.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <tbb/parallel_for.h>

#include "colmap_ext/plane_channels.h"
#include "phi/measurement.h"

namespace colmap_ext {

// The map as its compact file gives it back. To round twice changes nothing. Pixels without depth lose their normal; depths
// that are negative or not finite go.
phi::MeasurementMap RoundToCompact(phi::MeasurementMap map);

namespace compact {

inline constexpr int kBlock = 16;                 // pixels a side
inline constexpr std::uint32_t kMaxStep = 65534;  // of a depth; its code is one more, and 0 stands for none

// The depths of a block: the float with the bits base + step << shift.
struct BlockScale {
  std::uint32_t base = 0;
  std::uint32_t shift = 0;
};

// The blocks of a map.
struct Grid {
  int width, height;
  int columns() const { return (width + kBlock - 1) / kBlock; }
  int rows() const { return (height + kBlock - 1) / kBlock; }
  std::size_t num_blocks() const { return static_cast<std::size_t>(columns()) * static_cast<std::size_t>(rows()); }
  std::size_t num_pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  // Of the first of the blocks that row y of the map runs through.
  std::size_t FirstBlock(int y) const { return static_cast<std::size_t>(y / kBlock) * static_cast<std::size_t>(columns()); }
  std::size_t FirstPixel(int y) const { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width); }

  // function(begin, end) for the rows of the map that blocks hold, side by side.
  template <typename Function>
  void ForRowsOfBlocks(const Function& function) const {
    tbb::parallel_for(0, rows(), [&](int row) { function(row * kBlock, std::min((row + 1) * kBlock, height)); });
  }
};

// The bits of positive floats rise with their values.
constexpr std::uint32_t BitsOf(float depth) { return std::bit_cast<std::uint32_t>(depth); }

inline constexpr std::uint32_t kLargestBits = BitsOf(std::numeric_limits<float>::max());

inline __attribute__((always_inline)) std::uint32_t StepOf(const BlockScale& scale, std::uint32_t bits) {
  const std::uint32_t half = scale.shift > 0 ? std::uint32_t{1} << (scale.shift - 1) : 0;
  return (bits - scale.base + half) >> scale.shift;
}

// Rounding up may leave the floats.
inline __attribute__((always_inline)) float DepthAt(const BlockScale& scale, std::uint32_t step) {
  const std::uint64_t bits = scale.base + (std::uint64_t{step} << scale.shift);
  return std::bit_cast<float>(static_cast<std::uint32_t>(std::min<std::uint64_t>(bits, kLargestBits)));
}

// For the depths in rows begin to end, which the same blocks hold.
void FindScales(const phi::MeasurementMap& map, int begin, int end, BlockScale* scales);

// The codes of a row's pixels. Normals are on the octahedron of which the corner towards the camera is the middle: 0 to 4094 an axis,
// 2047 the middle. Of pixels without depth all codes are 0.
struct CodeRow {
  std::vector<std::uint16_t> depth, normal_x, normal_y;

  explicit CodeRow(int width);
  // Row y of the map; `scales`: of the blocks that it runs through.
  void Encode(const phi::MeasurementMap& map, int y, const BlockScale* scales);
  // False: some codes mean nothing.
  bool Decode(const BlockScale* scales, phi::PlaneHypothesis* planes);
  bool DecodeDepths(const BlockScale* scales, float* depths) const;  // alone; 0: none

 private:
  PlaneChannels channels_;
};

}  // namespace compact
}  // namespace colmap_ext
