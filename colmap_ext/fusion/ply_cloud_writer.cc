#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/fusion/cloud_files.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/ply_writer.h"
#include "colmap_ext/text_stream.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kColorBytes = 6;  // and the properties after them
constexpr std::size_t kBytesAfterPosition = 3 * sizeof(float) + kColorBytes;

std::vector<PlyVertexProperty> Properties(bool in_doubles) {
  const std::string_view position = in_doubles ? "double" : "float";
  return {{position, "x"},   {position, "y"},    {position, "z"},     {"float", "nx"},
          {"float", "ny"},   {"float", "nz"},    {"uchar", "red"},    {"uchar", "green"},
          {"uchar", "blue"}, {"uchar", "views"}, {"uchar", "inferred"},
          {"uchar", "confidence"}};
}

// The .vis file: its count, too, is completed at the end.
class VisibilityFile {
 public:
  VisibilityFile(const fs::path& path, std::shared_ptr<OpenFiles> open_files)
      : file_(path, Durability::kPowerCut, std::move(open_files)) {
    file_.Write(CountBytes(0));
  }
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

  // The two files side by side, and beside the blocks that follow.
  std::function<void()> Prepare(phi::FusedBlock block) override {
    return [this, packed = std::make_shared<const Packed>(Pack(block))] {
      Split(*packed, [&](const Piece& piece) {
        options_.queues->points.Add(piece.rows.size(), [packed, piece] { piece.WritePoints(); });
        options_.queues->views.Add(piece.words.size_bytes(), [packed, piece] { piece.WriteViews(); });
      });
    };
  }

  std::size_t num_files() const override { return files_.size(); }

  void Complete() override {
    if (is_complete_) return;
    options_.queues->points.Finish();
    options_.queues->views.Finish();
    for (const auto& file : files_) {
      file->cloud.Complete();
      file->visibility.Complete(file->cloud.num_vertices());
    }
    is_complete_ = true;
  }

  void Commit() override {
    Complete();
    for (const auto& file : files_) {
      file->visibility.Commit();
      file->cloud.Commit();
    }
    RemoveNumberedParts(options_.path, files_.size() + 1);
  }

 private:
  struct File {
    PlyWriter cloud;
    VisibilityFile visibility;
    std::uint64_t num_points = 0;  // written, or to be
  };
  // A block's points as the files hold them.
  struct Packed {
    std::size_t num_points;
    std::vector<unsigned char> rows;
    std::vector<std::uint32_t> words;  // of each point its number of views and the views
  };

  // What one file takes of a block. It holds the file, since queues that others share may outlive the writer.
  struct Piece {
    std::shared_ptr<File> file;
    std::size_t num_points;
    std::span<const unsigned char> rows;
    std::span<const std::uint32_t> words;

    void WritePoints() const { file->cloud.WriteVertices(rows.data(), rows.size(), num_points); }
    void WriteViews() const { file->visibility.Write(words.data(), words.size_bytes()); }
  };

  void OpenFile() {
    const fs::path path = NumberedPart(options_.path, files_.size() + 1);
    std::vector<std::string> comments;
    if (!files_.empty()) comments.push_back(NumberedPartComment(options_.path));
    const auto& offset = options_.offset;
    if (offset != std::array<double, 3>{0, 0, 0}) {
      TextOutput line;
      line.precision(17);
      line << "offset " << offset[0] << " " << offset[1] << " " << offset[2];
      comments.push_back(line.str());
    }
    const WriteQueues& queues = *options_.queues;
    files_.push_back(std::shared_ptr<File>(new File{{path, Properties(options_.in_doubles), comments, queues.point_files},
                                                    VisibilityFile(path.string() + ".vis", queues.view_files)}));
  }

  Packed Pack(const phi::FusedBlock& block) const {
    return {block.points.size(), options_.in_doubles ? PackRows<double>(block) : PackRows<float>(block), PackViews(block)};
  }

  template <typename Coordinate>
  std::vector<unsigned char> PackRows(const phi::FusedBlock& block) const {
    constexpr std::size_t kRowBytes = 3 * sizeof(Coordinate) + kBytesAfterPosition;
    std::vector<unsigned char> rows(block.points.size() * kRowBytes);
    unsigned char* row = rows.data();
    for (std::size_t i = 0; i < block.points.size(); ++i, row += kRowBytes) {
      const phi::FusedPoint& point = block.points[i];
      Coordinate position[3];
      for (std::size_t axis = 0; axis < 3; ++axis)
        position[axis] = static_cast<Coordinate>(point.xyz[axis] - options_.offset[axis]);
      const unsigned char bytes[kColorBytes] = {
          point.rgb[0], point.rgb[1], point.rgb[2],
          static_cast<unsigned char>(std::min<std::uint32_t>(block.view_counts[i], 255)), point.inferred, point.confidence};
      std::memcpy(row, position, sizeof(position));
      std::memcpy(row + sizeof(position), point.normal, sizeof(point.normal));
      std::memcpy(row + sizeof(position) + sizeof(point.normal), bytes, sizeof(bytes));
    }
    return rows;
  }

  static std::vector<std::uint32_t> PackViews(const phi::FusedBlock& block) {
    std::vector<std::uint32_t> words(block.points.size() + block.views.size());
    std::uint32_t* to = words.data();
    const std::uint32_t* next = block.views.data();
    for (const std::uint32_t count : block.view_counts) {
      *to++ = count;
      for (std::uint32_t i = 0; i < count; ++i) *to++ = *next++;
    }
    return words;
  }

  // write(piece) for the parts of a block, each in a file of its own.
  template <typename Write>
  void Split(const Packed& packed, const Write& write) {
    const std::size_t row_bytes = packed.num_points > 0 ? packed.rows.size() / packed.num_points : 0;
    const std::uint32_t *words = packed.words.data(), *const words_end = words + packed.words.size();
    for (std::size_t begin = 0; begin < packed.num_points;) {
      if (files_.back()->num_points == options_.max_points_per_file) OpenFile();
      const std::shared_ptr<File>& file = files_.back();
      const std::size_t count = std::min<std::uint64_t>(packed.num_points - begin, options_.max_points_per_file - file->num_points);
      const std::uint32_t* const next = begin + count < packed.num_points ? AfterPoints(words, count) : words_end;
      file->num_points += count;
      write(Piece{.file = file,
                  .num_points = count,
                  .rows = {packed.rows.data() + begin * row_bytes, count * row_bytes},
                  .words = {words, next}});
      words = next;
      begin += count;
    }
  }

  static const std::uint32_t* AfterPoints(const std::uint32_t* words, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) words += 1 + *words;
    return words;
  }

  PlyCloudOptions options_;
  std::vector<std::shared_ptr<File>> files_;
  bool is_complete_ = false;
};

}  // namespace

std::unique_ptr<CloudWriter> MakePlyCloudWriter(const PlyCloudOptions& options) {
  return std::make_unique<PlyCloudWriter>(options);
}

}  // namespace colmap_ext
