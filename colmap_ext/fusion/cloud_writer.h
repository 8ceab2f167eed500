// Where fusion puts its points, as they are made.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "colmap_ext/sparse_model.h"
#include "phi/fusion/image_fusion.h"

namespace colmap_ext {

// Nothing is left under a final name unless Commit() was called.
class CloudWriter {
 public:
  virtual ~CloudWriter() = default;
  virtual void Write(const phi::FusedBlock& block) = 0;
  virtual void Commit() = 0;
};

struct PlyCloudOptions {
  std::filesystem::path path;
  // Subtracted from all points, world units; other than zero it is written as `comment offset X Y Z`.
  std::array<double, 3> offset{0, 0, 0};
  // Points after these go to numbered files: NAME_2.ply, NAME_3.ply. Many readers count in 32 bits.
  std::uint64_t max_points_per_file = 0xffffffffu;
};

// Vertices: float x y z nx ny nz, uchar red green blue, uchar views (saturating), uchar inferred. Beside it PATH.vis: uint64
// count, then per point uint32 n and the n uint32 indices of the images that see it, in the model's order.
std::unique_ptr<CloudWriter> MakePlyCloudWriter(const PlyCloudOptions& options);

enum class SparseFormat { kBinary, kText };

// COLMAP's BIN and TXT output: the sparse model in `folder` with the cloud in place of its points, without tracks.
// `model` must outlive the writer.
std::unique_ptr<CloudWriter> MakeSparseCloudWriter(const SparseModel& model,
                                                   const std::filesystem::path& folder, SparseFormat format);

}  // namespace colmap_ext
