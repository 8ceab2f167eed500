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

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using phi::PixelState;
using compact::BitsOf;
using compact::BlockScale;
using compact::CodeOf;
using compact::Grid;
using compact::HasDepth;
using compact::NormalCode;
using compact::NormalOf;
using compact::StepOf;
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

// Of pixel i; 0: none.
float DepthOf(const Planes& planes, std::size_t i, const BlockScale& scale, const phi::Message& whose) {
  const std::uint32_t code = planes[0][i] | std::uint32_t{planes[1][i]} << 8;
  if (code == 0) return 0;
  const float depth = compact::DepthAt(scale, code - 1);
  if (!std::isnormal(depth)) ThrowDamaged(whose);
  return depth;
}

// Of pixel i, which has a depth.
PixelState StateOf(const Planes& planes, std::size_t i, const phi::Message& whose) {
  const std::uint8_t state = planes[kStatePlane][i];
  if (state == 0 || state > static_cast<std::uint8_t>(PixelState::kInferredConfirmed)) ThrowDamaged(whose);
  return static_cast<PixelState>(state);
}

}  // namespace

Bytes EncodeCompactMap(const phi::MeasurementMap& map) {
  const Grid grid{map.width(), map.height()};
  const std::vector<BlockScale> scales = compact::ScalesOf(map, grid);
  Planes planes;
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
  const Planes planes = ReadPlanes(header, true, whose, [&](std::size_t offset, std::size_t) { return bytes.data() + offset; });
  phi::MeasurementMap map{phi::PlaneMap(grid.width, grid.height), {}};
  if (header.has_states != 0) map.states = phi::StateMap(grid.width, grid.height);
  grid.ForPixels([&](std::size_t b, std::size_t i) {
    const float depth = DepthOf(planes, i, scales[b], whose);
    if (depth == 0) return;
    const std::uint32_t upper = planes[4][i];
    const NormalCode normal{planes[2][i] | (upper & 15) << 8, planes[3][i] | upper >> 4 << 8};
    if (std::max(normal.x, normal.y) > 2 * compact::kHalf) ThrowDamaged(whose);
    map.planes.data()[i] = {NormalOf(normal), depth};
    if (header.has_states != 0) map.states.data()[i] = StateOf(planes, i, whose);
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
  DepthRows rows{phi::DepthMap(grid.width, std::min(max_rows, grid.height)), grid.height};
  for (int y = 0; y < rows.depths.height(); ++y) {
    const int row = NearestPixel(y, rows.depths.height(), grid.height);
    for (int x = 0; x < grid.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(x);
      const int block = row / compact::kBlock * grid.columns() + x / compact::kBlock;
      const float depth = DepthOf(planes, i, scales[static_cast<std::size_t>(block)], whose);
      const bool is_hidden = depth > 0 && header.has_states != 0 && !IsPublished(StateOf(planes, i, whose));
      if (!is_hidden) rows.depths(x, y) = depth;
    }
  }
  return rows;
}

MapSize ReadCompactMapSize(const fs::path& path) {
  std::ifstream file = OpenRegularFile(path);
  const Header header = ReadHeader(file, path);
  return {header.width, header.height, 1};
}

}  // namespace colmap_ext
