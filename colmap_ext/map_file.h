// COLMAP's depth and normal maps: ASCII header `W&H&C&`, then little-endian float32, planar by channel.
// Depth is camera z, <= 0 is invalid; normals are unit vectors in the camera frame.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "phi/base/images.h"
#include "phi/geometry/plane_hypothesis.h"

namespace colmap_ext {

inline constexpr int kAllRows = std::numeric_limits<int>::max();

struct MapSize {
  int width = 0, height = 0, channels = 0;
};

// Size from the header alone, checked against the file's length. Throws phi::InputError naming the file.
MapSize ReadMapSize(const std::filesystem::path& path);

phi::Array2D<float> ReadDepthMap(const std::filesystem::path& path);
phi::Array2D<phi::Vec3f> ReadNormalMap(const std::filesystem::path& path);
// Thinned to a longer side of at most `longest_side` pixels (thinning.h). Read no other rows.
phi::Array2D<float> ReadThinnedDepthMap(const std::filesystem::path& path, int longest_side);
// Rows of a depth map, evenly over its height.
struct DepthRows {
  phi::Array2D<float> depths;
  int map_height = 0;
};
// At most `max_rows` of them, each whole.
DepthRows ReadDepthRows(const std::filesystem::path& path, int max_rows);
phi::Array2D<phi::Vec3f> ReadThinnedNormalMap(const std::filesystem::path& path, int longest_side);
phi::PlaneMap ReadPlaneMap(const std::filesystem::path& depth_path, const std::filesystem::path& normal_path);

// One row of a depth map and its normal map.
struct PlaneRow {
  const float* depth;
  const float* normal[3];
};

// Rows [begin, end) of a map, as far as it has them.
struct RowRange {
  int begin = 0, end = kAllRows;
};

// Calls consume(y, row) for each row in turn, without holding the maps: for readers that keep another form of them.
void ReadPlaneRows(const std::filesystem::path& depth_path, const std::filesystem::path& normal_path,
                   const std::function<void(int y, const PlaneRow&)>& consume, RowRange range = {});

// Complete files that wait for their names (AtomicFile::Publish), in the order in which they should get them.
using CompleteFiles = std::vector<std::unique_ptr<AtomicFile>>;

CompleteFiles PrepareDepthMap(const std::filesystem::path& path, const phi::Array2D<float>& depth,
                              Durability durability = Durability::kPowerCut);
// Depth last: whoever finds a depth map finds its normals too.
CompleteFiles PreparePlaneMap(const std::filesystem::path& depth_path,
                              const std::filesystem::path& normal_path, const phi::PlaneMap& map,
                              Durability durability = Durability::kPowerCut);

// All writers write a temporary file beside `path` and rename it: nothing half-written has a final name.
void WriteDepthMap(const std::filesystem::path& path, const phi::Array2D<float>& depth);
void WriteNormalMap(const std::filesystem::path& path, const phi::Array2D<phi::Vec3f>& normals);
void WritePlaneMap(const std::filesystem::path& depth_path, const std::filesystem::path& normal_path,
                   const phi::PlaneMap& map);

}  // namespace colmap_ext
