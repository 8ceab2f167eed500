// cameras.bin, images.bin, points3D.bin: little-endian, packed, each a 64-bit count and that many records.
#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <string>
#include <type_traits>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/sparse_model.h"
#include "colmap_ext/sparse_model_builder.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "COLMAP's models are little-endian");
static_assert(sizeof(Observation) == 24 && sizeof(TrackElement) == 8, "read as the file has them");

// Fewest bytes of a record, to tell an absurd count before memory is asked for it.
constexpr std::uint64_t kMinCameraBytes = 4 + 4 + 8 + 8;
constexpr std::uint64_t kMinImageBytes = 4 + 7 * 8 + 4 + 1 + 8;
constexpr std::uint64_t kMinPointBytes = 8 + 3 * 8 + 3 + 8 + 8;
constexpr std::size_t kMaxNameBytes = 4096;

class BinaryReader {
 public:
  explicit BinaryReader(const fs::path& path) : path_(path), file_(OpenRegularFile(path)) {
    std::error_code error;
    size_ = fs::file_size(path, error);
    if (!file_ || error) throw phi::InputError(phi::AboutFile(path) + ": cannot be opened; check its permissions, and that it is a file");
  }

  void ReadBytes(void* data, std::uint64_t num_bytes, const char* what) {
    if (num_bytes > size_ - position_) FailTruncated(what);
    file_.read(static_cast<char*>(data), static_cast<std::streamsize>(num_bytes));
    if (!file_) FailTruncated(what);
    position_ += num_bytes;
  }

  template <typename T>
  T Read(const char* what) {
    static_assert(std::is_arithmetic_v<T>);
    T value;
    ReadBytes(&value, sizeof(T), what);
    return value;
  }

  // A number of records, each at least `min_bytes` long.
  std::uint64_t ReadCount(std::uint64_t min_bytes, const char* what) {
    const std::uint64_t begin = position_;
    const auto count = Read<std::uint64_t>(what);
    if (count > (size_ - position_) / min_bytes) {
      throw phi::InputError(At(begin) + std::to_string(count) + " " + what +
                            " announced, but the file has only " + std::to_string(size_ - position_) +
                            " more bytes; it is damaged or incomplete: copy or export the model again");
    }
    return count;
  }

  std::string ReadName(const char* what) {
    std::string name;
    while (const char c = Read<char>(what)) {
      name.push_back(c);
      if (name.size() > kMaxNameBytes)
        throw phi::InputError(At(position_) + what + " has no end; the file is damaged");
    }
    return name;
  }

  ModelPosition position() const { return {&path_, "byte", position_}; }
  bool AtEnd() const { return position_ == size_; }

 private:
  phi::Message At(std::uint64_t byte) const { return ModelPosition{&path_, "byte", byte}.Text(); }

  [[noreturn]] void FailTruncated(const char* what) const {
    throw phi::InputError(At(size_) + "the file ends within " + what +
                          "; it is incomplete: copy or export the model again");
  }

  fs::path path_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
};

void ExpectEnd(const BinaryReader& reader, SparseModelBuilder* builder) {
  if (!reader.AtEnd())
    builder->Report(reader.position(), "more bytes follow the last record; the file is damaged");
}

void ReadCameras(const fs::path& path, SparseModelBuilder* builder) {
  BinaryReader reader(path);
  const std::uint64_t count = reader.ReadCount(kMinCameraBytes, "cameras");
  for (std::uint64_t i = 0; i < count; ++i) {
    const ModelPosition position = reader.position();
    SparseCamera camera;
    camera.camera_id = reader.Read<std::uint32_t>("a camera's id");
    camera.model_id = reader.Read<std::int32_t>("a camera's model");
    camera.width = reader.Read<std::uint64_t>("a camera's width");
    camera.height = reader.Read<std::uint64_t>("a camera's height");
    const auto num_params = NumCameraParams(camera.model_id);
    if (!num_params) {
      // The length of its record is unknown too, so that nothing after it can be read.
      throw phi::InputError(position.Text() + "camera " + std::to_string(camera.camera_id) + " has " +
                            CameraModelName(camera.model_id) +
                            "; run colmap image_undistorter, which makes pinhole cameras");
    }
    camera.params.resize(*num_params);
    reader.ReadBytes(camera.params.data(), 8 * *num_params, "a camera's parameters");
    builder->AddCamera(std::move(camera), position);
  }
  ExpectEnd(reader, builder);
}

void ReadImages(const fs::path& path, SparseModelBuilder* builder) {
  BinaryReader reader(path);
  const std::uint64_t count = reader.ReadCount(kMinImageBytes, "images");
  builder->ReserveImages(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const ModelPosition position = reader.position();
    SparseImage image;
    image.image_id = reader.Read<std::uint32_t>("an image's id");
    double pose[7];
    reader.ReadBytes(pose, sizeof(pose), "an image's pose");
    image.rotation = Eigen::Quaterniond(pose[0], pose[1], pose[2], pose[3]);
    image.translation = Eigen::Vector3d(pose[4], pose[5], pose[6]);
    image.camera_id = reader.Read<std::uint32_t>("an image's camera");
    image.name = reader.ReadName("an image's name");
    image.observations.resize(reader.ReadCount(sizeof(Observation), "observations"));
    reader.ReadBytes(image.observations.data(), image.observations.size() * sizeof(Observation),
                     "an image's observations");
    builder->AddImage(std::move(image), position);
  }
  ExpectEnd(reader, builder);
}

void ReadPoints(const fs::path& path, ModelPart part, SparseModelBuilder* builder) {
  BinaryReader reader(path);
  const std::uint64_t count = reader.ReadCount(kMinPointBytes, "points");
  const std::uint64_t num_read = part == ModelPart::kAll ? count : std::min<std::uint64_t>(count, 1);
  builder->ReservePoints(num_read);
  for (std::uint64_t i = 0; i < num_read; ++i) {
    const ModelPosition position = reader.position();
    SparsePoint point;
    point.point3D_id = reader.Read<std::uint64_t>("a point's id");
    reader.ReadBytes(point.xyz.data(), 24, "a point's position");
    reader.ReadBytes(point.rgb.data(), 3, "a point's colour");
    point.error = reader.Read<double>("a point's error");
    point.track.resize(reader.ReadCount(sizeof(TrackElement), "track elements"));
    reader.ReadBytes(point.track.data(), point.track.size() * sizeof(TrackElement), "a point's track");
    builder->AddPoint(std::move(point), position);
  }
  if (num_read == count) ExpectEnd(reader, builder);
}

template <typename T>
void WriteValue(AtomicFile* file, T value) {
  static_assert(std::is_arithmetic_v<T>);
  file->Write(&value, sizeof(T));
}

template <typename T>
void WriteCounted(AtomicFile* file, const std::vector<T>& records) {
  WriteValue(file, std::uint64_t{records.size()});
  file->Write(records.data(), records.size() * sizeof(T));
}

void WriteCamera(AtomicFile* file, const SparseCamera& camera) {
  WriteValue(file, camera.camera_id);
  WriteValue(file, std::int32_t{camera.model_id});
  WriteValue(file, camera.width);
  WriteValue(file, camera.height);
  file->Write(camera.params.data(), camera.params.size() * sizeof(double));
}

void WriteImage(AtomicFile* file, const SparseImage& image) {
  WriteValue(file, image.image_id);
  const Eigen::Quaterniond& q = image.rotation;
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) WriteValue(file, value);
  for (const double value : image.translation) WriteValue(file, value);
  WriteValue(file, image.camera_id);
  file->Write(image.name.c_str(), image.name.size() + 1);
  WriteCounted(file, image.observations);
}

void WritePoint(AtomicFile* file, const SparsePoint& point) {
  WriteValue(file, point.point3D_id);
  for (const double value : point.xyz) WriteValue(file, value);
  file->Write(point.rgb.data(), point.rgb.size());
  WriteValue(file, point.error);
  WriteCounted(file, point.track);
}

}  // namespace

SparseModel ReadSparseModelBinary(const fs::path& folder, ProblemList* problems, ModelPart part) {
  SparseModelBuilder builder(problems);
  const auto is_read = [&](const fs::path& path) { return part == ModelPart::kAll || fs::exists(path); };
  if (const fs::path cameras = folder / "cameras.bin"; is_read(cameras)) ReadCameras(cameras, &builder);
  if (const fs::path images = folder / "images.bin"; is_read(images)) ReadImages(images, &builder);
  if (const fs::path points = folder / "points3D.bin"; is_read(points)) ReadPoints(points, part, &builder);
  return builder.Finish();
}

void WriteSparseModelBinary(const SparseModel& model, const fs::path& folder) {
  AtomicFile points(folder / "points3D.bin");
  WriteValue(&points, std::uint64_t{model.points.size()});
  for (const SparsePoint& point : model.points) WritePoint(&points, point);
  WriteViewsBinary(model, folder, &points);
}

void WriteViewsBinary(const SparseModel& model, const fs::path& folder, AtomicFile* points) {
  AtomicFile cameras(folder / "cameras.bin"), images(folder / "images.bin");
  WriteValue(&cameras, std::uint64_t{model.cameras.size()});
  for (const auto& [id, camera] : model.cameras) WriteCamera(&cameras, camera);
  WriteValue(&images, std::uint64_t{model.images.size()});
  for (const SparseImage& image : model.images) WriteImage(&images, image);
  PublishModel(folder, ".bin", {points, &cameras, &images});
}

}  // namespace colmap_ext
