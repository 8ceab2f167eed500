#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/text_stream.h"
#include "colmap_ext/write_queue.h"
#include "phi/base/log.h"
#include "phi/base/message.h"

namespace colmap_ext {
namespace {

// Of a point in points3D.bin, behind its id and without a track.
constexpr std::size_t kRecordBytes = 3 * sizeof(double) + 3 + sizeof(double) + sizeof(std::uint64_t);

void AppendBinary(const phi::FusedPoint& point, std::string* bytes) {
  const auto append = [bytes](const auto& value) {
    bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  append(point.xyz);
  append(point.rgb);
  append(double{-1});        // reprojection error: unknown
  append(std::uint64_t{0});  // length of the track
}

class SparseCloudWriter : public CloudWriter {
 public:
  SparseCloudWriter(const SparseModel& model, std::filesystem::path folder, SparseFormat format)
      : model_(model),
        folder_(std::move(folder)),
        format_(format),
        points_(folder_ / (format == SparseFormat::kBinary ? "points3D.bin" : "points3D.txt")) {
    if (format_ == SparseFormat::kBinary) {
      points_.Write(std::string(sizeof(std::uint64_t), '\0'));
    } else {
      points_.Write(
          "# 3D point list with one line of data per point:\n#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, "
          "TRACK[]\n");
    }
  }

  std::function<void()> Prepare(phi::FusedBlock block) override {
    return [this, records = std::make_shared<const std::string>(Pack(block))] {
      queue_.Add(records->size(), [this, records] { WriteRecords(*records); });
    };
  }

  void Commit() override {
    queue_.Finish();
    SparseModel views{model_.cameras, model_.images, {}};
    // Observations of points that are no longer in the model would be dangling.
    for (SparseImage& image : views.images) {
      for (Observation& observation : image.observations) observation.point3D_id = kInvalidPoint3D;
    }
    const bool binary = format_ == SparseFormat::kBinary;
    if (binary) points_.WriteAt(0, std::string(reinterpret_cast<const char*>(&count_), sizeof(count_)));
    if (binary) {
      WriteViewsBinary(views, folder_, &points_);
    } else {
      WriteViewsText(views, folder_, &points_);
    }
    if (!binary && std::filesystem::exists(folder_ / "points3D.bin")) {
      phi::LogWarning(phi::AboutFile(folder_) +
                      " holds a model in .bin files too, which programs read rather than this one in .txt; remove those");
    }
  }

 private:
  // What the file says of the points but for their ids, which count all points before.
  std::string Pack(const phi::FusedBlock& block) const {
    if (format_ == SparseFormat::kBinary) {
      std::string bytes;
      bytes.reserve(block.points.size() * kRecordBytes);
      for (const phi::FusedPoint& point : block.points) AppendBinary(point, &bytes);
      return bytes;
    }
    TextOutput text;
    text.precision(17);
    for (const phi::FusedPoint& point : block.points) {
      text << " " << point.xyz[0] << " " << point.xyz[1] << " " << point.xyz[2] << " " << int{point.rgb[0]} << " "
           << int{point.rgb[1]} << " " << int{point.rgb[2]} << " -1\n";
    }
    return text.str();
  }

  void WriteRecords(const std::string& records) {
    const bool is_binary = format_ == SparseFormat::kBinary;
    std::string bytes;
    bytes.reserve(records.size() + records.size() / 4);  // about what the ids take
    for (std::size_t begin = 0, end = 0; begin < records.size(); begin = end) {
      end = is_binary ? begin + kRecordBytes : records.find('\n', begin) + 1;
      ++count_;
      if (is_binary) {
        bytes.append(reinterpret_cast<const char*>(&count_), sizeof(count_));
      } else {
        bytes += std::to_string(count_);
      }
      bytes.append(records, begin, end - begin);
    }
    points_.Write(bytes);
  }

  const SparseModel& model_;
  std::filesystem::path folder_;
  SparseFormat format_;
  AtomicFile points_;
  std::uint64_t count_ = 0;
  WriteQueue queue_;  // ends before the file does
};

}  // namespace

std::unique_ptr<CloudWriter> MakeSparseCloudWriter(const SparseModel& model,
                                                   const std::filesystem::path& folder, SparseFormat format) {
  return std::make_unique<SparseCloudWriter>(model, folder, format);
}

}  // namespace colmap_ext
