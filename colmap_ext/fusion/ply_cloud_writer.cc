#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/ply_writer.h"

namespace colmap_ext {
namespace {

constexpr std::size_t kBytesAfterPosition = 3 * sizeof(float) + 5;

std::vector<PlyVertexProperty> Properties(bool in_doubles) {
  const std::string_view position = in_doubles ? "double" : "float";
  return {{position, "x"},   {position, "y"},    {position, "z"},     {"float", "nx"},
          {"float", "ny"},   {"float", "nz"},    {"uchar", "red"},    {"uchar", "green"},
          {"uchar", "blue"}, {"uchar", "views"}, {"uchar", "inferred"}};
}

// The .vis file: its count, too, is completed at the end.
class VisibilityFile {
 public:
  explicit VisibilityFile(const std::filesystem::path& path) : file_(path) { file_.Write(CountBytes(0)); }
  void Write(const void* data, std::size_t num_bytes) { file_.Write(data, num_bytes); }
  void Complete(std::uint64_t count) {
    file_.WriteAt(0, CountBytes(count));
    file_.Complete();
  }
  void Commit() { file_.Commit(); }

 private:
  static std::string CountBytes(std::uint64_t count) {
    return std::string(reinterpret_cast<const char*>(&count), sizeof(count));
  }
  AtomicFile file_;
};

class PlyCloudWriter : public CloudWriter {
 public:
  explicit PlyCloudWriter(const PlyCloudOptions& options) : options_(options) { OpenFile(); }

  void Write(phi::FusedBlock block) override {
    std::size_t first_view = 0;
    for (std::size_t begin = 0; begin < block.points.size();) {
      if (files_.back().cloud->num_vertices() == options_.max_points_per_file) OpenFile();
      File& file = files_.back();
      const auto space = options_.max_points_per_file - file.cloud->num_vertices();
      const std::size_t end = begin + std::min<std::uint64_t>(block.points.size() - begin, space);
      // The two files side by side: on many cores writing is what fusion waits for. Isolated, so that neither waits
      // for a block that is being fused.
      tbb::this_task_arena::isolate([&] {
        tbb::parallel_invoke([&] { WriteRows(block, begin, end, &file); },
                             [&] { first_view = WriteViews(block, begin, end, first_view, &file); });
      });
      begin = end;
    }
  }

  void Commit() override {
    for (File& file : files_) {
      file.cloud->Complete();
      file.visibility->Complete(file.cloud->num_vertices());
    }
    for (File& file : files_) {
      file.visibility->Commit();
      file.cloud->Commit();
    }
  }

 private:
  struct File {
    std::unique_ptr<PlyWriter> cloud;
    std::unique_ptr<VisibilityFile> visibility;
  };

  void OpenFile() {
    std::filesystem::path path = options_.path;
    if (!files_.empty()) {
      path.replace_filename(path.stem().string() + "_" + std::to_string(files_.size() + 1) +
                            path.extension().string());
    }
    std::vector<std::string> comments;
    const auto& offset = options_.offset;
    if (offset != std::array<double, 3>{0, 0, 0}) {
      std::ostringstream line;
      line.precision(17);
      line << "offset " << offset[0] << " " << offset[1] << " " << offset[2];
      comments.push_back(line.str());
    }
    files_.push_back({std::make_unique<PlyWriter>(path, Properties(options_.in_doubles), comments),
                      std::make_unique<VisibilityFile>(path.string() + ".vis")});
  }

  void WriteRows(const phi::FusedBlock& block, std::size_t begin, std::size_t end, File* file) {
    if (options_.in_doubles) {
      WriteRowsAs<double>(block, begin, end, file);
    } else {
      WriteRowsAs<float>(block, begin, end, file);
    }
  }

  template <typename Coordinate>
  void WriteRowsAs(const phi::FusedBlock& block, std::size_t begin, std::size_t end, File* file) {
    constexpr std::size_t kRowBytes = 3 * sizeof(Coordinate) + kBytesAfterPosition;
    rows_.resize((end - begin) * kRowBytes);
    unsigned char* row = rows_.data();
    for (std::size_t i = begin; i < end; ++i, row += kRowBytes) {
      const phi::FusedPoint& point = block.points[i];
      Coordinate position[3];
      for (std::size_t axis = 0; axis < 3; ++axis)
        position[axis] = static_cast<Coordinate>(point.xyz[axis] - options_.offset[axis]);
      const unsigned char bytes[5] = {
          point.rgb[0], point.rgb[1], point.rgb[2],
          static_cast<unsigned char>(std::min<std::uint32_t>(block.view_counts[i], 255)), point.inferred};
      std::memcpy(row, position, sizeof(position));
      std::memcpy(row + sizeof(position), point.normal, sizeof(point.normal));
      std::memcpy(row + sizeof(position) + sizeof(point.normal), bytes, sizeof(bytes));
    }
    file->cloud->WriteVertices(rows_.data(), rows_.size(), end - begin);
  }

  std::size_t WriteViews(const phi::FusedBlock& block, std::size_t begin, std::size_t end,
                         std::size_t first_view, File* file) {
    words_.clear();
    for (std::size_t i = begin; i < end; ++i) {
      words_.push_back(block.view_counts[i]);
      const auto first = block.views.begin() + static_cast<std::ptrdiff_t>(first_view);
      words_.insert(words_.end(), first, first + block.view_counts[i]);
      first_view += block.view_counts[i];
    }
    file->visibility->Write(words_.data(), words_.size() * sizeof(std::uint32_t));
    return first_view;
  }

  PlyCloudOptions options_;
  std::vector<File> files_;
  std::vector<unsigned char> rows_;
  std::vector<std::uint32_t> words_;
};

}  // namespace

std::unique_ptr<CloudWriter> MakePlyCloudWriter(const PlyCloudOptions& options) {
  return std::make_unique<PlyCloudWriter>(options);
}

}  // namespace colmap_ext
