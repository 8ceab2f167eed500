#include "colmap_ext/map_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/plane_channels.h"
#include "colmap_ext/thinning.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "COLMAP's maps are little-endian");

// The longest header that fits: three decimal ints and three separators.
constexpr std::size_t kMaxHeaderBytes = 3 * 11;
constexpr int kMaxSide = 1 << 20;

std::uint64_t DataBytes(const MapSize& size) {
  return std::uint64_t{sizeof(float)} * size.width * size.height * size.channels;
}

std::string MapSizeText(const MapSize& size) {
  return SizeText(size.width, size.height) + "x" + std::to_string(size.channels);
}

// Parses `W&H&C&`; returns the header's length in bytes, or 0 when it is malformed.
std::size_t ParseHeader(std::string_view text, MapSize* size) {
  const char* next = text.data();
  const char* const end = text.data() + text.size();
  for (int* value : {&size->width, &size->height, &size->channels}) {
    const auto [rest, error] = std::from_chars(next, end, *value);
    if (error != std::errc() || rest == end || *rest != '&') return 0;
    if (*value < 1 || *value > kMaxSide) return 0;
    next = rest + 1;
  }
  return static_cast<std::size_t>(next - text.data());
}

// An open map, positioned at the first value.
class MapReader {
 public:
  explicit MapReader(const fs::path& path) : path_(path), file_(OpenRegularFile(path)) {
    std::error_code error;
    const std::uintmax_t file_bytes = fs::file_size(path, error);
    if (!file_ || error) {
      throw phi::InputError(phi::AboutFile(path) + ": cannot read this map: " +
                            (error ? error.message() : std::string("it cannot be opened")));
    }
    std::array<char, kMaxHeaderBytes> header{};
    file_.read(header.data(), header.size());
    const std::size_t header_bytes =
        ParseHeader({header.data(), static_cast<std::size_t>(file_.gcount())}, &size_);
    if (header_bytes == 0) {
      throw phi::InputError(phi::AboutFile(path) +
                            ": this is no COLMAP map: it must start with WIDTH&HEIGHT&CHANNELS&; delete it "
                            "and compute it again");
    }
    const std::uint64_t expected = header_bytes + DataBytes(size_);
    if (file_bytes != expected) {
      throw phi::InputError(phi::AboutFile(path) + ": the file has " + std::to_string(file_bytes) +
                            " bytes, but its header says " + MapSizeText(size_) + ", that is " +
                            std::to_string(expected) + " bytes; delete it and compute it again");
    }
    file_.clear();
    first_value_ = static_cast<std::streamoff>(header_bytes);
    file_.seekg(first_value_);
  }

  const MapSize& size() const { return size_; }

  void ExpectChannels(int channels, const char* kind) const {
    if (size_.channels == channels) return;
    throw phi::InputError(phi::AboutFile(path_) + ": a " + kind + " has " + std::to_string(channels) +
                          " channel(s), this file is " + MapSizeText(size_));
  }

  void Read(std::span<float> values) {
    file_.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size_bytes()));
    if (!file_) throw phi::InputError(phi::AboutFile(path_) + ": reading broke off; check the disk");
  }

  // Rows [y, y + num_rows) of a channel.
  void ReadRows(int channel, int y, int num_rows, std::vector<float>* rows) {
    rows->resize(std::size_t{1} * num_rows * size_.width);
    const std::int64_t first = (std::int64_t{1} * channel * size_.height + y) * size_.width;
    file_.seekg(first_value_ + static_cast<std::streamoff>(first * sizeof(float)));
    Read(*rows);
  }

  // Calls consume(x, y, value) for each pixel of a channel thinned to `size`.
  template <typename Consume>
  void ReadThinnedChannel(int channel, const ThinnedSize& size, const Consume& consume) {
    for (int y = 0; y < size.height; ++y) {
      ReadRows(channel, NearestPixel(y, size.height, size_.height), 1, &row_);
      for (int x = 0; x < size.width; ++x) consume(x, y, row_[NearestPixel(x, size.width, size_.width)]);
    }
  }

  // Calls consume(row, values) for each row of the next channel.
  template <typename Consume>
  void ReadChannel(const Consume& consume) {
    row_.resize(size_.width);
    for (int y = 0; y < size_.height; ++y) {
      Read(row_);
      consume(y, row_.data());
    }
  }

 private:
  fs::path path_;
  std::ifstream file_;
  std::streamoff first_value_ = 0;
  MapSize size_;
  std::vector<float> row_;
};

// The open maps of one image, of the same size.
struct PlaneReaders {
  PlaneReaders(const fs::path& depth_path, const fs::path& normal_path)
      : depth(depth_path), normal(normal_path), size(depth.size()) {
    depth.ExpectChannels(1, "depth map");
    normal.ExpectChannels(3, "normal map");
    if (normal.size().width != size.width || normal.size().height != size.height) {
      throw phi::InputError(phi::AboutFile(normal_path) + ": the normal map is " + MapSizeText(normal.size()) +
                            " but the depth map " + depth_path.string() + " is " + MapSizeText(size) +
                            "; delete both and compute them again");
    }
  }

  MapReader depth, normal;
  MapSize size;
};

class MapWriter {
 public:
  MapWriter(const fs::path& path, const MapSize& size, Durability durability = Durability::kPowerCut)
      : size_(size), file_(std::make_unique<AtomicFile>(path, durability)) {
    if (size.width < 1 || size.height < 1)
      throw phi::InputError(phi::AboutFile(path) + ": the map to write is empty");
    file_->Write(std::to_string(size.width) + "&" + std::to_string(size.height) + "&" +
                 std::to_string(size.channels) + "&");
    first_value_ = file_->bytes_written();
  }

  // Whole rows of a channel, row y first. In any order.
  void WriteRows(int channel, int y, const float* values, std::size_t num_values) {
    const std::uint64_t first = (std::uint64_t{1} * channel * size_.height + y) * size_.width;
    file_->WriteAt(first_value_ + first * sizeof(float), values, num_values * sizeof(float));
  }

  std::unique_ptr<AtomicFile> Complete() {
    file_->Complete();
    return std::move(file_);
  }

 private:
  MapSize size_;
  std::unique_ptr<AtomicFile> file_;
  std::uint64_t first_value_ = 0;
};

// Rows that are written at once: they stay in a processor's cache.
constexpr int kBandRows = 64;

constexpr std::array<float phi::Vec3f::*, 3> kComponents = {&phi::Vec3f::x, &phi::Vec3f::y, &phi::Vec3f::z};

}  // namespace

MapSize ReadMapSize(const fs::path& path) { return MapReader(path).size(); }

phi::Array2D<float> ReadDepthMap(const fs::path& path) {
  MapReader reader(path);
  reader.ExpectChannels(1, "depth map");
  auto depth = phi::Array2D<float>::Uninitialized(reader.size().width, reader.size().height);
  reader.Read({depth.data(), depth.size()});
  return depth;
}

phi::Array2D<phi::Vec3f> ReadNormalMap(const fs::path& path) {
  MapReader reader(path);
  reader.ExpectChannels(3, "normal map");
  phi::Array2D<phi::Vec3f> normals(reader.size().width, reader.size().height);
  for (const auto component : kComponents) {
    reader.ReadChannel([&](int y, const float* row) {
      for (int x = 0; x < normals.width(); ++x) normals(x, y).*component = row[x];
    });
  }
  return normals;
}

phi::Array2D<float> ReadThinnedDepthMap(const fs::path& path, int longest_side) {
  MapReader reader(path);
  reader.ExpectChannels(1, "depth map");
  const ThinnedSize size = FittingSize(reader.size().width, reader.size().height, longest_side);
  phi::Array2D<float> depth(size.width, size.height);
  reader.ReadThinnedChannel(0, size, [&](int x, int y, float value) { depth(x, y) = value; });
  return depth;
}

DepthRows ReadDepthRows(const fs::path& path, int max_rows) {
  MapReader reader(path);
  reader.ExpectChannels(1, "depth map");
  const ThinnedSize size{reader.size().width, std::min(max_rows, reader.size().height)};
  DepthRows rows{phi::Array2D<float>::Uninitialized(size.width, size.height), reader.size().height};
  if (size.height == rows.map_height) {
    reader.Read({rows.depths.data(), rows.depths.size()});
  } else {
    reader.ReadThinnedChannel(0, size, [&](int x, int y, float value) { rows.depths(x, y) = value; });
  }
  return rows;
}

phi::Array2D<phi::Vec3f> ReadThinnedNormalMap(const fs::path& path, int longest_side) {
  MapReader reader(path);
  reader.ExpectChannels(3, "normal map");
  const ThinnedSize size = FittingSize(reader.size().width, reader.size().height, longest_side);
  phi::Array2D<phi::Vec3f> normals(size.width, size.height);
  for (int c = 0; c < 3; ++c) {
    reader.ReadThinnedChannel(c, size, [&](int x, int y, float value) { normals(x, y).*kComponents[c] = value; });
  }
  return normals;
}

phi::PlaneMap ReadPlaneMap(const fs::path& depth_path, const fs::path& normal_path) {
  PlaneReaders readers(depth_path, normal_path);
  const MapSize size = readers.size;
  phi::PlaneMap map(size.width, size.height);
  readers.depth.ReadChannel([&](int y, const float* row) {
    for (int x = 0; x < size.width; ++x) map(x, y).depth = row[x];
  });
  for (const auto component : kComponents) {
    readers.normal.ReadChannel([&](int y, const float* row) {
      for (int x = 0; x < size.width; ++x) map(x, y).normal.*component = row[x];
    });
  }
  return map;
}

void ReadPlaneRows(const fs::path& depth_path, const fs::path& normal_path,
                   const std::function<void(int, const PlaneRow&)>& consume, RowRange range) {
  constexpr int kRows = 32;  // read at once
  PlaneReaders readers(depth_path, normal_path);
  std::array<std::vector<float>, 4> rows;  // depth, normal
  const int end = std::min(range.end, readers.size.height);
  for (int begin = range.begin; begin < end; begin += kRows) {
    const int count = std::min(kRows, end - begin);
    readers.depth.ReadRows(0, begin, count, &rows[0]);
    for (int c = 0; c < 3; ++c) readers.normal.ReadRows(c, begin, count, &rows[1 + c]);
    for (int i = 0; i < count; ++i) {
      const auto row = [&](int r) { return rows[r].data() + std::size_t{1} * i * readers.size.width; };
      consume(begin + i, {row(0), {row(1), row(2), row(3)}});
    }
  }
}

CompleteFiles PrepareDepthMap(const fs::path& path, const phi::Array2D<float>& depth, Durability durability) {
  MapWriter writer(path, {depth.width(), depth.height(), 1}, durability);
  writer.WriteRows(0, 0, depth.data(), depth.size());
  CompleteFiles files;
  files.push_back(writer.Complete());
  return files;
}

CompleteFiles PreparePlaneMap(const fs::path& depth_path, const fs::path& normal_path,
                              const phi::PlaneMap& map, Durability durability) {
  MapWriter normal(normal_path, {map.width(), map.height(), 3}, durability);
  MapWriter depth(depth_path, {map.width(), map.height(), 1}, durability);
  const auto width = static_cast<std::size_t>(map.width());
  PlaneChannels band(kBandRows * width);
  for (int y = 0; y < map.height(); y += kBandRows) {
    const std::size_t size = static_cast<std::size_t>(std::min(kBandRows, map.height() - y)) * width;
    band.Load(&map(0, y), size);
    normal.WriteRows(0, y, band.x.data(), size);
    normal.WriteRows(1, y, band.y.data(), size);
    normal.WriteRows(2, y, band.z.data(), size);
    depth.WriteRows(0, y, band.depth.data(), size);
  }
  CompleteFiles files;
  files.push_back(normal.Complete());
  files.push_back(depth.Complete());
  return files;
}

void WriteDepthMap(const fs::path& path, const phi::Array2D<float>& depth) {
  PrepareDepthMap(path, depth).front()->Commit();
}

void WriteNormalMap(const fs::path& path, const phi::Array2D<phi::Vec3f>& normals) {
  MapWriter writer(path, {normals.width(), normals.height(), 3});
  std::vector<float> channel(normals.size());
  for (int c = 0; c < 3; ++c) {
    std::transform(normals.begin(), normals.end(), channel.begin(), [&](const phi::Vec3f& n) { return n.*kComponents[c]; });
    writer.WriteRows(c, 0, channel.data(), channel.size());
  }
  writer.Complete()->Commit();
}

void WritePlaneMap(const fs::path& depth_path, const fs::path& normal_path, const phi::PlaneMap& map) {
  for (const auto& file : PreparePlaneMap(depth_path, normal_path, map)) file->Commit();
}

}  // namespace colmap_ext
