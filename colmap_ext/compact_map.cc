#include "colmap_ext/compact_map.h"

#include <lz4.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "colmap_ext/compact_codes.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/thinning.h"
#include "phi/base/error.h"
#include "phi/base/whole_array.h"
#include "phi/base/wide_vectors.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using phi::PixelState;
using compact::BlockScale;
using compact::CodeRow;
using compact::Grid;
using Bytes = std::vector<std::uint8_t>;

static_assert(std::endian::native == std::endian::little, "compact maps are little-endian");

constexpr char kMagic[8] = {'P', 'H', 'I', 'M', 'A', 'P', '1', '\n'};
constexpr int kNumPlanes = 6;    // depth's low and high byte; low bytes of the normal's axes, their upper bits; state
constexpr int kFirstNormalPlane = 2, kStatePlane = kNumPlanes - 1;
using Planes = std::array<Bytes, kNumPlanes>;
constexpr int kMaxSide = 1 << 20;
constexpr std::size_t kScaleBytes = 5;  // of a block

struct Header {
  char magic[8];
  std::int32_t width, height;
  std::int32_t has_states;
  std::int32_t num_plane_bytes[kNumPlanes];  // compressed
};

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
    if (scales[b].shift > 16 || scales[b].base > compact::kLargestBits) ThrowDamaged(whose);
  }
  return scales;
}

PHI_WIDE_VECTORS void SplitBytes(const std::uint16_t* codes, std::size_t size, std::uint8_t* low, std::uint8_t* high) {
  for (std::size_t i = 0; i < size; ++i) {
    low[i] = static_cast<std::uint8_t>(codes[i]);
    high[i] = static_cast<std::uint8_t>(codes[i] >> 8);
  }
}

PHI_WIDE_VECTORS void SplitNormals(const std::uint16_t* x, const std::uint16_t* y, std::size_t size, std::uint8_t* x_low,
                                   std::uint8_t* y_low, std::uint8_t* upper) {
  for (std::size_t i = 0; i < size; ++i) {
    x_low[i] = static_cast<std::uint8_t>(x[i]);
    y_low[i] = static_cast<std::uint8_t>(y[i]);
    upper[i] = static_cast<std::uint8_t>(x[i] >> 8 | y[i] >> 8 << 4);
  }
}

PHI_WIDE_VECTORS void JoinBytes(const std::uint8_t* low, const std::uint8_t* high, std::size_t size, std::uint16_t* codes) {
  for (std::size_t i = 0; i < size; ++i) codes[i] = static_cast<std::uint16_t>(low[i] | high[i] << 8);
}

PHI_WIDE_VECTORS void JoinNormals(const std::uint8_t* x_low, const std::uint8_t* y_low, const std::uint8_t* upper, std::size_t size,
                                  std::uint16_t* x, std::uint16_t* y) {
  for (std::size_t i = 0; i < size; ++i) {
    x[i] = static_cast<std::uint16_t>(x_low[i] | (upper[i] & 15) << 8);
    y[i] = static_cast<std::uint16_t>(y_low[i] | upper[i] >> 4 << 8);
  }
}

// Of pixels with depth; others' are 0.
PHI_WIDE_VECTORS void SplitStates(const std::uint16_t* depth, const PixelState* states, std::size_t size, std::uint8_t* plane) {
  for (std::size_t i = 0; i < size; ++i) plane[i] = depth[i] != 0 ? static_cast<std::uint8_t>(states[i]) : 0;
}

// Of pixels with depth; others have none. False: some numbers are no state.
PHI_WIDE_VECTORS bool JoinStates(const std::uint16_t* depth, const std::uint8_t* plane, std::size_t size, PixelState* states) {
  constexpr auto kLast = static_cast<std::uint8_t>(PixelState::kInferredConfirmed);
  unsigned wrong = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const bool has_depth = depth[i] != 0;
    wrong |= static_cast<unsigned>(has_depth & ((plane[i] == 0) | (plane[i] > kLast)));
    states[i] = static_cast<PixelState>(has_depth ? plane[i] : 0);
  }
  return wrong == 0;
}

// part(offset, size): so many bytes of the file, which stay until the next call. Without those of normals, which are not asked for then.
template <typename Part>
Planes ReadPlanes(const Header& header, bool with_normals, const phi::Message& whose, const Part& part) {
  const Grid grid{header.width, header.height};
  std::size_t at = sizeof(header) + grid.num_blocks() * kScaleBytes;
  Planes planes;
  for (int p = 0; p < kNumPlanes; ++p) {
    const auto size = static_cast<std::size_t>(header.num_plane_bytes[p]);
    const bool is_normal = p >= kFirstNormalPlane && p < kStatePlane, is_absent = p == kStatePlane && header.has_states == 0;
    if (with_normals || !is_normal) planes[p] = Decompressed(part(at, size), size, is_absent ? 0 : grid.num_pixels(), whose);
    at += size;
  }
  return planes;
}

// The codes of a row, whose first pixel is number `first`, as the planes hold them.
void SplitRow(const CodeRow& codes, std::size_t first, Planes* planes) {
  const std::size_t size = codes.depth.size();
  SplitBytes(codes.depth.data(), size, &(*planes)[0][first], &(*planes)[1][first]);
  SplitNormals(codes.normal_x.data(), codes.normal_y.data(), size, &(*planes)[2][first], &(*planes)[3][first], &(*planes)[4][first]);
}

void JoinRow(const Planes& planes, std::size_t first, CodeRow* codes) {
  const std::size_t size = codes->depth.size();
  JoinBytes(&planes[0][first], &planes[1][first], size, codes->depth.data());
  JoinNormals(&planes[2][first], &planes[3][first], &planes[4][first], size, codes->normal_x.data(), codes->normal_y.data());
}

}  // namespace

Bytes EncodeCompactMap(const phi::MeasurementMap& map) {
  const Grid grid{map.width(), map.height()};
  std::vector<BlockScale> scales(grid.num_blocks());
  Planes planes;
  for (Bytes& plane : planes) plane.resize(grid.num_pixels());
  if (map.states.empty()) planes.back().clear();
  grid.ForRowsOfBlocks([&](int begin, int end) {
    BlockScale* const scales_here = &scales[grid.FirstBlock(begin)];
    compact::FindScales(map, begin, end, scales_here);
    CodeRow codes(grid.width);
    for (int y = begin; y < end; ++y) {
      codes.Encode(map, y, scales_here);
      SplitRow(codes, grid.FirstPixel(y), &planes);
      if (map.states.empty()) continue;
      SplitStates(codes.depth.data(), &map.states(0, y), codes.depth.size(), &planes[kStatePlane][grid.FirstPixel(y)]);
    }
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
  const Planes planes = ReadPlanes(header, true, whose, [&](std::size_t offset, std::size_t) { return bytes.data() + offset; });
  phi::MeasurementMap map{phi::PlaneMap::Uninitialized(grid.width, grid.height), {}};
  if (header.has_states != 0) map.states = phi::StateMap::Uninitialized(grid.width, grid.height);
  grid.ForRowsOfBlocks([&](int begin, int end) {
    CodeRow codes(grid.width);
    for (int y = begin; y < end; ++y) {
      JoinRow(planes, grid.FirstPixel(y), &codes);
      bool is_right = codes.Decode(&scales[grid.FirstBlock(y)], &map.planes(0, y));
      if (header.has_states != 0) {
        is_right &= JoinStates(codes.depth.data(), &planes[kStatePlane][grid.FirstPixel(y)], codes.depth.size(), &map.states(0, y));
      }
      if (!is_right) ThrowDamaged(whose);
    }
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

DepthRows ReadCompactDepthRows(const fs::path& path, int max_rows) {
  std::ifstream file = OpenRegularFile(path);
  const Header header = ReadHeader(file, path);
  const phi::Message whose = phi::AboutFile(path);
  const Grid grid{header.width, header.height};
  Bytes read;
  const auto part = [&](std::size_t offset, std::size_t num_bytes) {
    read.resize(num_bytes);
    file.seekg(static_cast<std::streamoff>(offset));
    file.read(reinterpret_cast<char*>(read.data()), static_cast<std::streamsize>(read.size()));
    if (!file) ThrowDamaged(whose);
    return read.data();
  };
  const std::vector<BlockScale> scales = ReadScales(part(sizeof(header), grid.num_blocks() * kScaleBytes), grid.num_blocks(), whose);
  const Planes planes = ReadPlanes(header, false, whose, part);
  DepthRows rows{phi::DepthMap::Uninitialized(grid.width, std::min(max_rows, grid.height)), grid.height};
  phi::DepthMap& depths = rows.depths;
  phi::ForRows(depths.height(), [&](int begin, int end) {
    CodeRow codes(grid.width);
    phi::StateMap states(grid.width, 1);
    for (int y = begin; y < end; ++y) {
      const int row = NearestPixel(y, depths.height(), grid.height);
      const std::size_t first = grid.FirstPixel(row);
      JoinBytes(&planes[0][first], &planes[1][first], codes.depth.size(), codes.depth.data());
      bool is_right = codes.DecodeDepths(&scales[grid.FirstBlock(row)], &depths(0, y));
      if (header.has_states != 0) {
        is_right &= JoinStates(codes.depth.data(), &planes[kStatePlane][first], codes.depth.size(), states.data());
        for (int x = 0; x < grid.width; ++x) depths(x, y) = IsPublished(states(x, 0)) ? depths(x, y) : 0;
      }
      if (!is_right) ThrowDamaged(whose);
    }
  });
  return rows;
}

MapSize ReadCompactMapSize(const fs::path& path) {
  std::ifstream file = OpenRegularFile(path);
  const Header header = ReadHeader(file, path);
  return {header.width, header.height, 1};
}

}  // namespace colmap_ext
