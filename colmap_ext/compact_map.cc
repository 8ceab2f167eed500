#include "colmap_ext/compact_map.h"

#include <lz4.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "colmap_ext/input_file.h"
#include "colmap_ext/plane_channels.h"
#include "phi/base/error.h"
#include "phi/base/wide_vectors.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using phi::PixelState;
using Bytes = std::vector<std::uint8_t>;

static_assert(std::endian::native == std::endian::little, "compact maps are little-endian");

constexpr char kMagic[8] = {'P', 'H', 'I', 'M', 'A', 'P', '1', '\n'};
constexpr int kBlock = 16;       // pixels a side
constexpr int kNumPlanes = 6;    // depth's low and high byte; low bytes of the normal's axes, their upper bits; state
constexpr int kMaxSide = 1 << 20;
constexpr std::size_t kScaleBytes = 5;  // of a block
constexpr std::uint32_t kMaxStep = 65534;  // of a depth; its code is one more, and 0 stands for none

struct Header {
  char magic[8];
  std::int32_t width, height;
  std::int32_t has_states;
  std::int32_t num_plane_bytes[kNumPlanes];  // compressed
};

// The depths of a block: the float with the bits base + step << shift.
struct BlockScale {
  std::uint32_t base = 0;
  std::uint32_t shift = 0;
};

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

bool HasDepth(const phi::MeasurementMap& map, std::size_t i) {
  const float depth = map.planes.data()[i].depth;
  const bool is_known = map.states.empty() || map.states.data()[i] != PixelState::kNone;
  return is_known && depth > 0 && std::isnormal(depth);
}

// The bits of positive floats rise with their values.
std::uint32_t BitsOf(float depth) { return std::bit_cast<std::uint32_t>(depth); }

inline __attribute__((always_inline)) std::uint32_t StepOf(const BlockScale& scale, std::uint32_t bits) {
  const std::uint32_t half = scale.shift > 0 ? std::uint32_t{1} << (scale.shift - 1) : 0;
  return (bits - scale.base + half) >> scale.shift;
}

const std::uint32_t kLargestBits = BitsOf(std::numeric_limits<float>::max());

// Rounding up may leave the floats.
inline __attribute__((always_inline)) float DepthAt(const BlockScale& scale, std::uint32_t step) {
  const std::uint64_t bits = scale.base + (std::uint64_t{step} << scale.shift);
  return std::bit_cast<float>(static_cast<std::uint32_t>(std::min<std::uint64_t>(bits, kLargestBits)));
}

// The finest steps that reach from the least depth to the largest.
BlockScale ScaleOf(std::uint32_t least, std::uint32_t largest) {
  BlockScale scale{least, 0};
  while (StepOf(scale, largest) > kMaxStep) {
    ++scale.shift;
    scale.base = least >> scale.shift << scale.shift;  // so that depths once rounded are steps of any finer scale
  }
  return scale;
}

// Normals, on the octahedron of which the corner towards the camera is the middle: 0 to 4094 an axis, 2047 the middle.
constexpr int kHalf = 2047;
struct NormalCode {
  std::uint32_t x = kHalf, y = kHalf;
};

float SignOf(float v) { return v >= 0 ? 1.0f : -1.0f; }

// As std::lround, without a call.
int Rounded(float v) { return static_cast<int>(static_cast<double>(v) + (v >= 0 ? 0.5 : -0.5)); }

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

[[noreturn]] void ThrowDamaged(const phi::Message& whose) {
  throw phi::InputError(whose + ": this map is damaged or of another version; delete it and compute it again");
}

void Append(const void* data, std::size_t num_bytes, Bytes* bytes) {
  if (num_bytes == 0) return;
  const std::size_t begin = bytes->size();
  bytes->resize(begin + num_bytes);
  std::memcpy(bytes->data() + begin, data, num_bytes);
}

// As it is where that is shorter.
Bytes Compressed(const Bytes& plane) {
  Bytes compressed(plane.size());
  if (plane.empty()) return plane;
  const int size = LZ4_compress_default(reinterpret_cast<const char*>(plane.data()), reinterpret_cast<char*>(compressed.data()),
                                        static_cast<int>(plane.size()), static_cast<int>(compressed.size()));
  if (size <= 0 || static_cast<std::size_t>(size) >= plane.size()) return plane;
  compressed.resize(static_cast<std::size_t>(size));
  return compressed;
}

// The next plane, of num_bytes.
Bytes Decompressed(const std::uint8_t* data, std::size_t size, std::size_t num_bytes, const phi::Message& whose) {
  constexpr std::size_t kMostRatio = 255;  // of LZ4
  if (size == num_bytes) return Bytes(data, data + size);
  if (size > num_bytes || num_bytes / kMostRatio > size) ThrowDamaged(whose);
  Bytes plane(num_bytes);
  const int got = LZ4_decompress_safe(reinterpret_cast<const char*>(data), reinterpret_cast<char*>(plane.data()),
                                      static_cast<int>(size), static_cast<int>(num_bytes));
  if (got < 0 || static_cast<std::size_t>(got) != num_bytes) ThrowDamaged(whose);
  return plane;
}

Header CheckedHeader(const std::uint8_t* data, std::size_t size, const phi::Message& whose) {
  Header header;
  if (size < sizeof(header)) ThrowDamaged(whose);
  std::memcpy(&header, data, sizeof(header));
  const bool has_size = header.width >= 1 && header.width <= kMaxSide && header.height >= 1 && header.height <= kMaxSide &&
                        std::int64_t{header.width} * header.height <= LZ4_MAX_INPUT_SIZE;
  const bool knows_states = header.has_states == 0 || header.has_states == 1;
  if (std::memcmp(header.magic, kMagic, sizeof(kMagic)) != 0 || !has_size || !knows_states) ThrowDamaged(whose);
  for (const std::int32_t num_bytes : header.num_plane_bytes) {
    if (num_bytes < 0 || num_bytes > header.width * header.height) ThrowDamaged(whose);
  }
  return header;
}

// Of the whole file.
std::size_t NumBytes(const Header& header) {
  std::size_t num_bytes = sizeof(header) + Grid{header.width, header.height}.num_blocks() * kScaleBytes;
  for (const std::int32_t size : header.num_plane_bytes) num_bytes += static_cast<std::size_t>(size);
  return num_bytes;
}

Header ReadHeader(std::ifstream& file, const fs::path& path) {
  std::error_code unknown;
  const std::uintmax_t num_bytes = fs::file_size(path, unknown);
  if (!file || unknown) throw phi::InputError(phi::AboutFile(path) + ": cannot read this map: it cannot be opened");
  Bytes bytes(sizeof(Header));
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const Header header = CheckedHeader(bytes.data(), static_cast<std::size_t>(file.gcount()), phi::AboutFile(path));
  if (num_bytes != NumBytes(header)) ThrowDamaged(phi::AboutFile(path));
  return header;
}

// data: all blocks' least bits, then all blocks' steps.
std::vector<BlockScale> ReadScales(const std::uint8_t* data, std::size_t num_blocks, const phi::Message& whose) {
  std::vector<BlockScale> scales(num_blocks);
  for (std::size_t b = 0; b < num_blocks; ++b) {
    std::memcpy(&scales[b].base, data + 4 * b, 4);
    scales[b].shift = data[4 * num_blocks + b];
    if (scales[b].shift > 16 || scales[b].base > kLargestBits) ThrowDamaged(whose);
  }
  return scales;
}

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

}  // namespace

phi::MeasurementMap RoundToCompact(phi::MeasurementMap map) {
  const Grid grid{map.width(), map.height()};
  const std::vector<BlockScale> scales = ScalesOf(map, grid);
  tbb::parallel_for(0, map.height(), [&](int y) {
    const int width = map.width();
    PlaneChannels row(static_cast<std::size_t>(width));
    row.Load(&map.planes(0, y), static_cast<std::size_t>(width));
    RoundNormals(row.x.data(), row.y.data(), row.z.data(), width);
    const BlockScale* scale = &scales[static_cast<std::size_t>(y / kBlock) * static_cast<std::size_t>(grid.columns())];
    for (int x = 0; x < width; x += kBlock) RoundDepths(*scale++, &row.depth[x], std::min(kBlock, width - x));
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    for (int x = 0; x < width; ++x) {
      if (HasDepth(map, first + static_cast<std::size_t>(x))) {
        map.planes(x, y) = {{row.x[x], row.y[x], row.z[x]}, row.depth[x]};
      } else {
        map.planes(x, y) = {};
        if (!map.states.empty()) map.states(x, y) = PixelState::kNone;
      }
    }
  });
  map.testimonies = {};
  return map;
}

Bytes EncodeCompactMap(const phi::MeasurementMap& map) {
  const Grid grid{map.width(), map.height()};
  const std::vector<BlockScale> scales = ScalesOf(map, grid);
  std::array<Bytes, kNumPlanes> planes;
  for (Bytes& plane : planes) plane.assign(grid.num_pixels(), 0);
  if (map.states.empty()) planes.back().clear();
  grid.ForPixels([&](std::size_t b, std::size_t i) {
    if (!HasDepth(map, i)) return;
    const phi::PlaneHypothesis& plane = map.planes.data()[i];
    const std::uint32_t code = StepOf(scales[b], BitsOf(plane.depth)) + 1;
    const NormalCode normal = CodeOf(plane.normal);
    planes[0][i] = static_cast<std::uint8_t>(code);
    planes[1][i] = static_cast<std::uint8_t>(code >> 8);
    planes[2][i] = static_cast<std::uint8_t>(normal.x);
    planes[3][i] = static_cast<std::uint8_t>(normal.y);
    planes[4][i] = static_cast<std::uint8_t>(normal.x >> 8 | normal.y >> 8 << 4);
    if (!map.states.empty()) planes[5][i] = static_cast<std::uint8_t>(map.states.data()[i]);
  });
  Header header{{}, map.width(), map.height(), map.states.empty() ? 0 : 1, {}};
  std::copy(std::begin(kMagic), std::end(kMagic), header.magic);
  for (int p = 0; p < kNumPlanes; ++p) {
    planes[p] = Compressed(planes[p]);
    header.num_plane_bytes[p] = static_cast<std::int32_t>(planes[p].size());
  }
  Bytes bytes;
  Append(&header, sizeof(header), &bytes);
  for (const BlockScale& scale : scales) Append(&scale.base, sizeof(scale.base), &bytes);
  for (const BlockScale& scale : scales) bytes.push_back(static_cast<std::uint8_t>(scale.shift));
  for (const Bytes& plane : planes) Append(plane.data(), plane.size(), &bytes);
  return bytes;
}

phi::MeasurementMap DecodeCompactMap(const Bytes& bytes, const phi::Message& whose) {
  const Header header = CheckedHeader(bytes.data(), bytes.size(), whose);
  if (bytes.size() != NumBytes(header)) ThrowDamaged(whose);
  const Grid grid{header.width, header.height};
  const std::vector<BlockScale> scales = ReadScales(bytes.data() + sizeof(header), grid.num_blocks(), whose);
  std::size_t at = sizeof(header) + grid.num_blocks() * kScaleBytes;
  std::array<Bytes, kNumPlanes> planes;
  for (int p = 0; p < kNumPlanes; ++p) {
    const auto size = static_cast<std::size_t>(header.num_plane_bytes[p]);
    const bool is_absent = p == kNumPlanes - 1 && header.has_states == 0;
    planes[p] = Decompressed(bytes.data() + at, size, is_absent ? 0 : grid.num_pixels(), whose);
    at += size;
  }
  phi::MeasurementMap map{phi::PlaneMap(grid.width, grid.height), {}};
  if (header.has_states != 0) map.states = phi::StateMap(grid.width, grid.height);
  grid.ForPixels([&](std::size_t b, std::size_t i) {
    const std::uint32_t code = planes[0][i] | std::uint32_t{planes[1][i]} << 8;
    if (code == 0) return;
    const std::uint32_t upper = planes[4][i];
    const NormalCode normal{planes[2][i] | (upper & 15) << 8, planes[3][i] | upper >> 4 << 8};
    map.planes.data()[i] = {NormalOf(normal), DepthAt(scales[b], code - 1)};
    if (std::max(normal.x, normal.y) > 2 * kHalf || !std::isnormal(map.planes.data()[i].depth)) ThrowDamaged(whose);
    if (header.has_states == 0) return;
    map.states.data()[i] = static_cast<PixelState>(planes[5][i]);
    const bool has_state = planes[5][i] > 0 && planes[5][i] <= static_cast<std::uint8_t>(PixelState::kInferredConfirmed);
    if (!has_state) ThrowDamaged(whose);
  });
  return map;
}

fs::path CompactMapPath(const Workspace& workspace, int image, std::string_view kind) {
  return workspace.StereoFolder() / "compact_maps" /
         (workspace.views()[static_cast<std::size_t>(image)].name + "." + std::string(kind) + ".map");
}

std::unique_ptr<AtomicFile> PrepareCompactMap(const fs::path& path, const phi::MeasurementMap& map, Durability durability) {
  const Bytes bytes = EncodeCompactMap(map);
  auto file = std::make_unique<AtomicFile>(path, durability);
  file->Write(bytes.data(), bytes.size());
  file->Complete();
  return file;
}

phi::MeasurementMap ReadCompactMap(const fs::path& path) {
  std::ifstream file = OpenRegularFile(path);
  Bytes bytes(NumBytes(ReadHeader(file, path)));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file) ThrowDamaged(phi::AboutFile(path));
  return DecodeCompactMap(bytes, phi::AboutFile(path));
}

MapSize ReadCompactMapSize(const fs::path& path) {
  std::ifstream file = OpenRegularFile(path);
  const Header header = ReadHeader(file, path);
  return {header.width, header.height, 1};
}

}  // namespace colmap_ext
