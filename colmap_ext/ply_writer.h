// Streams the vertices of a binary little-endian PLY file; the count in the header is completed at the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "colmap_ext/atomic_file.h"

namespace colmap_ext {

struct PlyVertexProperty {
  std::string_view type;  // "float", "double", "uchar", ...
  std::string_view name;
};

class PlyWriter {
 public:
  PlyWriter(const std::filesystem::path& path, const std::vector<PlyVertexProperty>& properties,
            const std::vector<std::string>& comments, std::shared_ptr<OpenFiles> open_files = nullptr);

  // Rows packed as the properties say.
  void WriteVertices(const void* rows, std::size_t num_bytes, std::uint64_t num_vertices);
  std::uint64_t num_vertices() const { return num_vertices_; }
  // Writes the count; see AtomicFile::Complete.
  void Complete();
  // Without it nothing is left of the file.
  void Commit();

 private:
  std::string CountLines() const;

  AtomicFile file_;
  std::uint64_t count_offset_ = 0;
  std::uint64_t num_vertices_ = 0;
  bool complete_ = false;
};

}  // namespace colmap_ext
