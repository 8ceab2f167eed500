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

#include "phi/base/vec.h"
#include "phi/measurement.h"

namespace colmap_ext {

// The map as its compact file gives it back. To round twice changes nothing. Pixels without depth lose their normal; depths
// that are negative or not finite, and testimonies, go.
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

  // function(block, index of pixel) for all pixels, block by block, blocks in parallel.
  template <typename Function>
  void ForPixels(const Function& function) const {
    tbb::parallel_for(0, columns() * rows(), [&](int block) {
      ForPixelsOf(block, [&](std::size_t i) { function(static_cast<std::size_t>(block), i); });
    });
  }

  // function(index of pixel)
  template <typename Function>
  void ForPixelsOf(int block, const Function& function) const {
    const int x0 = block % columns() * kBlock, y0 = block / columns() * kBlock;
    for (int y = y0; y < std::min(y0 + kBlock, height); ++y) {
      for (int x = x0; x < std::min(x0 + kBlock, width); ++x)
        function(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    }
  }
};

inline bool HasDepth(const phi::MeasurementMap& map, std::size_t i) {
  const float depth = map.planes.data()[i].depth;
  const bool is_known = map.states.empty() || map.states.data()[i] != phi::PixelState::kNone;
  return is_known && depth > 0 && std::isnormal(depth);
}

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

// Of each block, for the depths that it holds.
std::vector<BlockScale> ScalesOf(const phi::MeasurementMap& map, const Grid& grid);

// Normals, on the octahedron of which the corner towards the camera is the middle: 0 to 4094 an axis, 2047 the middle.
inline constexpr int kHalf = 2047;
struct NormalCode {
  std::uint32_t x = kHalf, y = kHalf;
};

inline float SignOf(float v) { return v >= 0 ? 1.0f : -1.0f; }

// As std::lround, without a call.
inline int Rounded(float v) { return static_cast<int>(static_cast<double>(v) + (v >= 0 ? 0.5 : -0.5)); }

// Without branches, so that a loop over normals becomes vector instructions.
inline __attribute__((always_inline)) NormalCode CodeOf(phi::Vec3f n) {
  const float sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  const bool is_normal = (sum > 0) & (sum <= std::numeric_limits<float>::max());
  const float divisor = is_normal ? sum : 1.0f;
  const float x = is_normal ? n.x / divisor : 0.0f, y = is_normal ? n.y / divisor : 0.0f;
  const bool is_folded = is_normal & (n.z > 0);
  const float u = is_folded ? (1 - std::abs(y)) * SignOf(x) : x, v = is_folded ? (1 - std::abs(x)) * SignOf(y) : y;
  int column = Rounded(u * kHalf), row = Rounded(v * kHalf);
  // Each point of the square's rim has a twin that is the same direction.
  column = std::abs(row) == kHalf ? std::abs(column) : column;
  row = std::abs(column) == kHalf ? std::abs(row) : row;
  return {static_cast<std::uint32_t>(column + kHalf), static_cast<std::uint32_t>(row + kHalf)};
}

inline __attribute__((always_inline)) phi::Vec3f NormalOf(NormalCode code) {
  const float x = static_cast<float>(static_cast<int>(code.x) - kHalf) / kHalf;
  const float y = static_cast<float>(static_cast<int>(code.y) - kHalf) / kHalf;
  const float z = 1 - std::abs(x) - std::abs(y);
  const float u = z < 0 ? (1 - std::abs(y)) * SignOf(x) : x, v = z < 0 ? (1 - std::abs(x)) * SignOf(y) : y;
  return phi::Normalized({u, v, -z});
}

}  // namespace compact
}  // namespace colmap_ext
