#include "colmap_ext/compact_codes.h"

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

// The bits of positive floats that are neither subnormal nor infinite.
inline __attribute__((always_inline)) bool IsDepth(std::uint32_t bits) {
  constexpr std::uint32_t kLeast = BitsOf(std::numeric_limits<float>::min());
  return bits - kLeast <= kLargestBits - kLeast;
}

// Of a row's pixels: the bits of their depths, 0 for none. `states`: null where there are none.
PHI_WIDE_VECTORS void ReadBits(const phi::PlaneHypothesis* planes, const phi::PixelState* states, std::size_t size, std::uint32_t* bits) {
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t value = BitsOf(planes[i].depth);
    bits[i] = IsDepth(value) ? value : 0;
  }
  if (states == nullptr) return;
  for (std::size_t i = 0; i < size; ++i) bits[i] = states[i] != phi::PixelState::kNone ? bits[i] : 0;
}

const phi::PixelState* StatesOf(const phi::MeasurementMap& map, int y) { return map.states.empty() ? nullptr : &map.states(0, y); }

// `bits`: 0 for none.
PHI_WIDE_VECTORS void AddRow(const std::uint32_t* bits, std::size_t size, std::uint32_t* least, std::uint32_t* largest) {
  for (std::size_t i = 0; i < size; ++i) {
    least[i] = std::min(least[i], bits[i] - 1);  // none: the largest number
    largest[i] = std::max(largest[i], bits[i]);
  }
}

// Of depths in one block.
PHI_WIDE_VECTORS void EncodeDepths(BlockScale scale, const std::uint32_t* bits, int size, std::uint16_t* codes) {
  for (int i = 0; i < size; ++i) codes[i] = static_cast<std::uint16_t>(bits[i] != 0 ? StepOf(scale, bits[i]) + 1 : 0);
}

constexpr int kHalf = 2047;  // codes of an axis, either side of the middle

inline __attribute__((always_inline)) float SignOf(float v) { return v >= 0 ? 1.0f : -1.0f; }

// As std::lround, without a call.
inline __attribute__((always_inline)) int Rounded(float v) {
  return static_cast<int>(static_cast<double>(v) + (v >= 0 ? 0.5 : -0.5));
}

// Of any three numbers. Without branches, as all loops here, so that they become vector instructions.
PHI_WIDE_VECTORS void EncodeNormals(const float* nx, const float* ny, const float* nz, const std::uint16_t* depth_codes, std::size_t size,
                                    std::uint16_t* x_codes, std::uint16_t* y_codes) {
  for (std::size_t i = 0; i < size; ++i) {
    const float sum = std::abs(nx[i]) + std::abs(ny[i]) + std::abs(nz[i]);
    const bool is_normal = (sum > 0) & (sum <= std::numeric_limits<float>::max());
    const float divisor = is_normal ? sum : 1.0f;
    const float x = is_normal ? nx[i] / divisor : 0.0f, y = is_normal ? ny[i] / divisor : 0.0f;
    const bool is_folded = is_normal & (nz[i] > 0);
    const float u = is_folded ? (1 - std::abs(y)) * SignOf(x) : x, v = is_folded ? (1 - std::abs(x)) * SignOf(y) : y;
    int column = Rounded(u * kHalf), row = Rounded(v * kHalf);
    // Each point of the square's rim has a twin that is the same direction.
    column = std::abs(row) == kHalf ? std::abs(column) : column;
    row = std::abs(column) == kHalf ? std::abs(row) : row;
    x_codes[i] = static_cast<std::uint16_t>(depth_codes[i] != 0 ? column + kHalf : 0);
    y_codes[i] = static_cast<std::uint16_t>(depth_codes[i] != 0 ? row + kHalf : 0);
  }
}

// Of depths in one block; 0 for none. What is no depth is a code of nothing.
PHI_WIDE_VECTORS void DecodeDepths(BlockScale scale, const std::uint16_t* codes, int size, float* depth) {
  for (int i = 0; i < size; ++i) depth[i] = codes[i] != 0 ? DepthAt(scale, codes[i] - 1u) : 0.0f;
}

// Of pixels with depth; others get none. False: some codes mean nothing.
PHI_WIDE_VECTORS bool DecodeNormals(const std::uint16_t* depth_codes, const std::uint16_t* x_codes, const std::uint16_t* y_codes,
                                    std::size_t size, float* nx, float* ny, float* nz) {
  unsigned wrong = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const bool has_depth = depth_codes[i] != 0;
    const int column = x_codes[i] - kHalf, row = y_codes[i] - kHalf;
    wrong |= static_cast<unsigned>(has_depth & (std::max(column, row) > kHalf));
    const float x = static_cast<float>(column) / kHalf, y = static_cast<float>(row) / kHalf;
    const float z = 1 - std::abs(x) - std::abs(y);
    const float u = z < 0 ? (1 - std::abs(y)) * SignOf(x) : x, v = z < 0 ? (1 - std::abs(x)) * SignOf(y) : y;
    const phi::Vec3f normal = phi::Normalized({u, v, -z});
    nx[i] = has_depth ? normal.x : 0;
    ny[i] = has_depth ? normal.y : 0;
    nz[i] = has_depth ? normal.z : 0;
  }
  return wrong == 0;
}

PHI_WIDE_VECTORS bool AreDepths(const std::uint16_t* codes, const float* depth, std::size_t size) {
  unsigned wrong = 0;
  for (std::size_t i = 0; i < size; ++i) wrong |= static_cast<unsigned>((codes[i] != 0) & !IsDepth(BitsOf(depth[i])));
  return wrong == 0;
}

std::vector<std::uint32_t> BitsOfRow(const phi::MeasurementMap& map, int y) {
  std::vector<std::uint32_t> bits(static_cast<std::size_t>(map.width()));
  ReadBits(&map.planes(0, y), StatesOf(map, y), bits.size(), bits.data());
  return bits;
}

// function(first pixel, number of pixels) for what each block holds of a row.
template <typename Function>
void ForBlocks(std::size_t width, const Function& function) {
  for (std::size_t x = 0; x < width; x += kBlock) function(x, static_cast<int>(std::min<std::size_t>(kBlock, width - x)));
}

}  // namespace

void FindScales(const phi::MeasurementMap& map, int begin, int end, BlockScale* scales) {
  const auto width = static_cast<std::size_t>(map.width());
  std::vector<std::uint32_t> least(width, std::numeric_limits<std::uint32_t>::max()), largest(width, 0);
  for (int y = begin; y < end; ++y) AddRow(BitsOfRow(map, y).data(), width, least.data(), largest.data());
  ForBlocks(width, [&](std::size_t x, int size) {
    const std::uint32_t most = *std::max_element(&largest[x], &largest[x] + size);
    *scales++ = most > 0 ? ScaleOf(*std::min_element(&least[x], &least[x] + size) + 1, most) : BlockScale();
  });
}

CodeRow::CodeRow(int width)
    : depth(static_cast<std::size_t>(width)), normal_x(depth.size()), normal_y(depth.size()), channels_(depth.size()) {}

void CodeRow::Encode(const phi::MeasurementMap& map, int y, const BlockScale* scales) {
  const std::vector<std::uint32_t> bits = BitsOfRow(map, y);
  ForBlocks(bits.size(), [&](std::size_t x, int size) { EncodeDepths(*scales++, &bits[x], size, &depth[x]); });
  channels_.Load(&map.planes(0, y), bits.size());
  EncodeNormals(channels_.x.data(), channels_.y.data(), channels_.z.data(), depth.data(), bits.size(), normal_x.data(), normal_y.data());
}

bool CodeRow::DecodeDepths(const BlockScale* scales, float* depths) const {
  ForBlocks(depth.size(), [&](std::size_t x, int size) { compact::DecodeDepths(*scales++, &depth[x], size, &depths[x]); });
  return AreDepths(depth.data(), depths, depth.size());
}

bool CodeRow::Decode(const BlockScale* scales, phi::PlaneHypothesis* planes) {
  const bool is_right = DecodeDepths(scales, channels_.depth.data()) &
                        DecodeNormals(depth.data(), normal_x.data(), normal_y.data(), depth.size(), channels_.x.data(),
                                      channels_.y.data(), channels_.z.data());
  channels_.Store(depth.size(), planes);
  return is_right;
}

}  // namespace compact

phi::MeasurementMap RoundToCompact(phi::MeasurementMap map) {
  const compact::Grid grid{map.width(), map.height()};
  grid.ForRowsOfBlocks([&](int begin, int end) {
    std::vector<compact::BlockScale> scales(static_cast<std::size_t>(grid.columns()));
    compact::FindScales(map, begin, end, scales.data());
    compact::CodeRow codes(grid.width);
    for (int y = begin; y < end; ++y) {
      codes.Encode(map, y, scales.data());
      codes.Decode(scales.data(), &map.planes(0, y));
      if (map.states.empty()) continue;
      for (int x = 0; x < grid.width; ++x) {
        phi::PixelState& state = map.states(x, y);
        state = codes.depth[static_cast<std::size_t>(x)] != 0 ? state : phi::PixelState::kNone;
      }
    }
  });
  return map;
}

}  // namespace colmap_ext
