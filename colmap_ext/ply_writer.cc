#include "colmap_ext/ply_writer.h"

#include <utility>

namespace colmap_ext {

PlyWriter::PlyWriter(const std::filesystem::path& path, const std::vector<PlyVertexProperty>& properties,
                     const std::vector<std::string>& comments, std::shared_ptr<OpenFiles> open_files)
    : file_(path, Durability::kPowerCut, std::move(open_files)) {
  file_.Write("ply\nformat binary_little_endian 1.0\n");
  for (const std::string& comment : comments) file_.Write("comment " + comment + "\n");
  count_offset_ = file_.bytes_written();
  file_.Write(CountLines());
  for (const PlyVertexProperty& property : properties) {
    file_.Write("property " + std::string(property.type) + " " + std::string(property.name) + "\n");
  }
  file_.Write("end_header\n");
}

// The element line comes after a comment that pads both to one length for every count: readers differ in what they
// make of leading zeros or spaces in a number.
std::string PlyWriter::CountLines() const {
  constexpr std::size_t kMaxDigits = 20;
  const std::string count = std::to_string(num_vertices_);
  return "comment count complete" + std::string(kMaxDigits - count.size(), '.') + "\nelement vertex " +
         count + "\n";
}

void PlyWriter::WriteVertices(const void* rows, std::size_t num_bytes, std::uint64_t num_vertices) {
  file_.Write(rows, num_bytes);
  num_vertices_ += num_vertices;
}

void PlyWriter::Complete() {
  if (complete_) return;
  file_.WriteAt(count_offset_, CountLines());
  file_.Complete();
  complete_ = true;
}

void PlyWriter::Commit() {
  Complete();
  file_.Commit();
}

}  // namespace colmap_ext
