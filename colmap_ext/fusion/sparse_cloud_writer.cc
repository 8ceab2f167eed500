#include <filesystem>
#include <string>
#include <utility>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/text_stream.h"
#include "phi/base/log.h"
#include "phi/base/message.h"

namespace colmap_ext {
namespace {

// A record of points3D.bin without a track.
void AppendBinary(std::uint64_t id, const phi::FusedPoint& point, std::string* bytes) {
  const auto append = [bytes](const auto& value) {
    bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  append(id);
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

  void Write(phi::FusedBlock block) override {
    std::string bytes;
    TextOutput text;
    text.precision(17);
    for (const phi::FusedPoint& point : block.points) {
      ++count_;
      if (format_ == SparseFormat::kBinary) {
        AppendBinary(count_, point, &bytes);
      } else {
        text << count_ << " " << point.xyz[0] << " " << point.xyz[1] << " " << point.xyz[2] << " "
             << int{point.rgb[0]} << " " << int{point.rgb[1]} << " " << int{point.rgb[2]} << " -1\n";
      }
    }
    points_.Write(format_ == SparseFormat::kBinary ? bytes : text.str());
  }

  void Commit() override {
    SparseModel empty = model_;
    empty.points.clear();
    // Observations of points that are no longer in the model would be dangling.
    for (SparseImage& image : empty.images) {
      for (Observation& observation : image.observations) observation.point3D_id = kInvalidPoint3D;
    }
    const bool binary = format_ == SparseFormat::kBinary;
    if (binary) points_.WriteAt(0, std::string(reinterpret_cast<const char*>(&count_), sizeof(count_)));
    points_.Complete();
    if (binary) {
      WriteSparseModelBinary(empty, folder_);
    } else {
      WriteSparseModelText(empty, folder_);
    }
    points_.Commit();
    if (!binary && std::filesystem::exists(folder_ / "points3D.bin")) {
      phi::LogWarning(phi::AboutFile(folder_) +
                      " holds a model in .bin files too, which programs read rather than this one in .txt; remove those");
    }
  }

 private:
  const SparseModel& model_;
  std::filesystem::path folder_;
  SparseFormat format_;
  AtomicFile points_;
  std::uint64_t count_ = 0;
};

}  // namespace

std::unique_ptr<CloudWriter> MakeSparseCloudWriter(const SparseModel& model,
                                                   const std::filesystem::path& folder, SparseFormat format) {
  return std::make_unique<SparseCloudWriter>(model, folder, format);
}

}  // namespace colmap_ext
