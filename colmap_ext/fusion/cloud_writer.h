// Where fusion puts its points, as they are made.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/sparse_model.h"
#include "colmap_ext/write_queue.h"
#include "phi/fusion/image_fusion.h"

namespace colmap_ext {

// Nothing is left under a final name unless Commit() was called.
class CloudWriter {
 public:
  virtual ~CloudWriter() = default;
  // A writer overrides this, or Prepare() where some of it can be done ahead.
  virtual void Write(phi::FusedBlock block) { Prepare(std::move(block))(); }
  // Does of Write() what can be done on any thread and in any order; what it returns does the rest, and is called once, in the order of the
  // blocks. It may leave the writing to a thread, which Commit() waits for. Holds no reference to anything but the writer.
  virtual std::function<void()> Prepare(phi::FusedBlock block) {
    return [this, shared = std::make_shared<phi::FusedBlock>(std::move(block))] { Write(std::move(*shared)); };
  }
  // Takes up a point, to be written with the next Flush(). False: the format cannot hold it, and it is left out.
  virtual bool Add(const phi::FusedPoint& point, std::uint32_t num_views, const std::uint32_t* views) {
    added_.points.push_back(point);
    added_.view_counts.push_back(num_views);
    added_.views.insert(added_.views.end(), views, views + num_views);
    return true;
  }
  virtual void Flush() { Write(std::exchange(added_, {})); }
  virtual std::uint64_t num_left_out() const { return 0; }  // of the points so far
  virtual std::size_t num_files() const { return 1; }       // that hold the points so far
  // Does all of Commit() but for the names, where that can be done apart: for clouds that get their names together.
  virtual void Complete() {}
  virtual void Commit() = 0;

 private:
  phi::FusedBlock added_;
};

// The threads of a cloud's files, which write while its points are made: on many cores fusion would wait for them. Tiles share one pair,
// so that there are no more threads than of one file, and of each kind so many files at most are open.
struct WriteQueues {
  WriteQueue points, views;
  std::shared_ptr<OpenFiles> point_files = nullptr, view_files = nullptr;  // none: all are
};
std::shared_ptr<WriteQueues> MakeQueuesOfTiles(std::size_t max_open_files = 400);  // of each kind: 1024 are usual of a process

struct PlyCloudOptions {
  std::filesystem::path path;
  // Subtracted from all points, world units; other than zero it is written as `comment offset X Y Z`.
  std::array<double, 3> offset{0, 0, 0};
  bool in_doubles = false;  // x, y and z, where even so single precision is too coarse
  // Points after these go to numbered files: NAME_2.ply, NAME_3.ply, with `comment continues NAME.ply`. Many readers count in 32 bits, some
  // with a sign. Commit removes those that a larger cloud of this name left.
  std::uint64_t max_points_per_file = 0x7fffffffu;
  std::shared_ptr<WriteQueues> queues = std::make_shared<WriteQueues>();
};

// Vertices: float (or double) x y z, float nx ny nz, uchar red green blue, uchar views (saturating), uchar inferred, uchar confidence
// (per cent, 0: not judged). Beside it PATH.vis: uint64 count, then per point uint32 n and the n uint32 indices of the images that see
// it, in the model's order.
std::unique_ptr<CloudWriter> MakePlyCloudWriter(const PlyCloudOptions& options);

struct LasCloudOptions {
  std::filesystem::path path;
  // Points are written as whole multiples of the scale from the offset, 32 bits each; world units.
  double scale = 0.001;
  std::array<double, 3> offset{0, 0, 0};
  std::string crs = {};  // WKT of the world's coordinate system, at most kMaxCrsBytes; empty: none
  std::shared_ptr<WriteQueues> queues = std::make_shared<WriteQueues>();
};
inline constexpr std::size_t kMaxCrsBytes = 65534;  // of a LAS record, but for its final zero

// LAS 1.4, point format 7: position, colour in 16 bits, extra bytes `views` (16 bits, saturating), `inferred` and `confidence`. Points that
// 32 bits do not reach are left out.
std::unique_ptr<CloudWriter> MakeLasCloudWriter(const LasCloudOptions& options);

enum class SparseFormat { kBinary, kText };

// COLMAP's BIN and TXT output: the sparse model in `folder` with the cloud in place of its points, without tracks.
// `model` must outlive the writer.
std::unique_ptr<CloudWriter> MakeSparseCloudWriter(const SparseModel& model,
                                                   const std::filesystem::path& folder, SparseFormat format);

struct TileOptions {
  std::filesystem::path path;          // of the whole cloud, NAME.ply or NAME.las: tiles are NAME_COLUMN_ROW.*
  double size = 0;                     // of a tile's sides along x and y, world units
  std::array<double, 2> origin{0, 0};  // a corner of the tile 0, 0; world units
};

// A file for each square of x and y that has points which its format can hold, made by `make_writer(path)`, and NAME.tiles.json, which
// lists them with their bounds and numbers of points. Throws phi::InputError for a size that coordinates do not tell apart.
std::unique_ptr<CloudWriter> MakeTiledCloudWriter(
    const TileOptions& options,
    std::function<std::unique_ptr<CloudWriter>(const std::filesystem::path&)> make_writer);

}  // namespace colmap_ext
