// cameras.txt, images.txt, points3D.txt: a record a line (an image: two lines), fields parted by spaces, #
// comments.
#include <algorithm>
#include <charconv>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/config_lines.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/sparse_model.h"
#include "colmap_ext/sparse_model_builder.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSpace = " \t\r";

// The fields of one line, from left to right.
class LineParser {
 public:
  LineParser(std::string_view line, const ModelPosition& position) : rest_(line), position_(position) {
    SkipSpace();
  }

  bool AtEnd() const { return rest_.empty(); }

  std::string_view Word(const char* what) {
    if (rest_.empty()) Fail(std::string("the line ends before ") + what);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kSpace));
    rest_.remove_prefix(word.size());
    SkipSpace();
    return word;
  }

  template <typename T>
  T Number(const char* what) {
    const std::string_view word = Word(what);
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      Fail(std::string(what) + " is expected, not '" + std::string(word) + "'");
    }
    return value;
  }

  // What is left of the line: names may hold spaces.
  std::string Rest() {
    const std::string_view rest = rest_.substr(0, rest_.find_last_not_of(kSpace) + 1);
    rest_ = {};
    return std::string(rest);
  }

  const ModelPosition& position() const { return position_; }

  [[noreturn]] void Fail(const std::string& message) const {
    throw phi::InputError(position_.Text() + message);
  }

 private:
  void SkipSpace() { rest_.remove_prefix(std::min(rest_.find_first_not_of(kSpace), rest_.size())); }

  std::string_view rest_;
  ModelPosition position_;
};

// Lines of a model's text file, with the number of records that its header announces.
class TextReader {
 public:
  explicit TextReader(const fs::path& path) : path_(path), file_(OpenRegularFile(path)) {
    if (!file_) throw phi::InputError(phi::AboutFile(path) + ": cannot be opened; check its permissions, and that it is a file");
  }

  // The next line that holds a record: neither empty nor a comment.
  bool NextRecord() {
    while (NextLine()) {
      const std::size_t first = line_.find_first_not_of(kSpace);
      if (first == std::string::npos) continue;
      if (line_[first] != '#') return true;
      ParseComment();
    }
    if (file_.bad()) throw phi::InputError(phi::AboutFile(path_) + ": reading broke off; check the disk");
    return false;
  }

  bool NextLine() {
    if (!std::getline(file_, line_)) return false;
    if (++line_number_ == 1) {
      RequireUtf8(path_, line_);
      if (line_.starts_with(kByteOrderMark)) line_.erase(0, kByteOrderMark.size());
    }
    ends_with_newline_ = !file_.eof();
    return true;
  }

  const std::string& line() const { return line_; }
  ModelPosition position() const { return {&path_, "line", line_number_}; }

  // COLMAP's header says how many records follow, which tells a file that was cut short.
  void CheckEnd(std::uint64_t num_records, SparseModelBuilder* builder) const {
    if (num_records < announced_) {
      builder->Report(position(),
                      "the file ends after " + std::to_string(num_records) + " of " +
                          std::to_string(announced_) +
                          " records; it is incomplete: copy or export the model again (if you took "
                          "records out, correct the number in the comment at its head)");
    } else if (!ends_with_newline_) {
      phi::LogWarning(position().Text() + "the last line has no end; the file may be incomplete");
    }
  }

 private:
  void ParseComment() {
    constexpr std::string_view kPrefix = "# Number of ";
    if (!line_.starts_with(kPrefix)) return;
    const std::size_t colon = line_.find(": ");
    if (colon == std::string::npos) return;
    std::from_chars(line_.data() + colon + 2, line_.data() + line_.size(), announced_);
  }

  fs::path path_;
  std::ifstream file_;
  std::string line_;
  std::uint64_t line_number_ = 0;
  std::uint64_t announced_ = 0;
  bool ends_with_newline_ = true;
};

void ReadCameras(const fs::path& path, SparseModelBuilder* builder) {
  TextReader reader(path);
  std::uint64_t count = 0;
  for (; reader.NextRecord(); ++count) {
    LineParser parser(reader.line(), reader.position());
    SparseCamera camera;
    camera.camera_id = parser.Number<std::uint32_t>("a camera's id");
    const std::string model_name(parser.Word("a camera's model"));
    const auto model_id = CameraModelIdFromName(model_name);
    if (!model_id) {
      builder->Report(reader.position(), "camera " + std::to_string(camera.camera_id) +
                                             " has the unknown camera model " + model_name +
                                             "; run colmap image_undistorter, which makes pinhole cameras");
      continue;
    }
    camera.model_id = *model_id;
    camera.width = parser.Number<std::uint64_t>("a camera's width");
    camera.height = parser.Number<std::uint64_t>("a camera's height");
    while (!parser.AtEnd()) camera.params.push_back(parser.Number<double>("a camera's parameter"));
    builder->AddCamera(std::move(camera), reader.position());
  }
  reader.CheckEnd(count, builder);
}

Observation ReadObservation(LineParser* parser) {
  Observation observation;
  observation.x = parser->Number<double>("an observation's x");
  observation.y = parser->Number<double>("an observation's y");
  const std::string_view id = parser->Word("an observation's point id");
  if (id != "-1")
    observation.point3D_id = LineParser(id, parser->position()).Number<std::uint64_t>("a point's id");
  return observation;
}

void ReadImages(const fs::path& path, SparseModelBuilder* builder) {
  TextReader reader(path);
  std::uint64_t count = 0;
  for (; reader.NextRecord(); ++count) {
    const ModelPosition position = reader.position();
    LineParser parser(reader.line(), position);
    SparseImage image;
    image.image_id = parser.Number<std::uint32_t>("an image's id");
    double pose[7];
    for (double& value : pose) value = parser.Number<double>("a number of an image's pose");
    image.rotation = Eigen::Quaterniond(pose[0], pose[1], pose[2], pose[3]);
    image.translation = Eigen::Vector3d(pose[4], pose[5], pose[6]);
    image.camera_id = parser.Number<std::uint32_t>("an image's camera");
    image.name = parser.Rest();
    // The line of observations follows at once and is empty when there are none.
    if (reader.NextLine()) {
      LineParser observations(reader.line(), reader.position());
      while (!observations.AtEnd()) image.observations.push_back(ReadObservation(&observations));
    }
    builder->AddImage(std::move(image), position);
  }
  reader.CheckEnd(count, builder);
}

void ReadPoints(const fs::path& path, ModelPart part, SparseModelBuilder* builder) {
  TextReader reader(path);
  std::uint64_t count = 0;
  for (; reader.NextRecord(); ++count) {
    LineParser parser(reader.line(), reader.position());
    SparsePoint point;
    point.point3D_id = parser.Number<std::uint64_t>("a point's id");
    for (double& value : point.xyz) value = parser.Number<double>("a point's coordinate");
    for (std::uint8_t& value : point.rgb) value = parser.Number<std::uint8_t>("a point's colour (0 to 255)");
    point.error = parser.Number<double>("a point's error");
    while (!parser.AtEnd()) {
      TrackElement element;
      element.image_id = parser.Number<std::uint32_t>("a track's image id");
      element.observation_index = parser.Number<std::uint32_t>("a track's observation index");
      point.track.push_back(element);
    }
    builder->AddPoint(std::move(point), reader.position());
    if (part == ModelPart::kHead) return;
  }
  reader.CheckEnd(count, builder);
}

// Shortest text that reads back as the same number.
template <typename T>
void Put(AtomicFile* file, T value, char end = ' ') {
  char text[32];
  const auto result = std::to_chars(text, text + sizeof(text) - 1, value);
  *result.ptr = end;
  file->Write(text, result.ptr + 1 - text);
}

void PutHeader(AtomicFile* file, std::string_view fields, std::string_view records, std::size_t count) {
  file->Write("# " + std::string(fields) + "\n# Number of " + std::string(records) + ": " +
              std::to_string(count) + "\n");
}

void WriteCamera(AtomicFile* file, const SparseCamera& camera) {
  Put(file, camera.camera_id);
  file->Write(CameraModelName(camera.model_id) + " ");
  Put(file, camera.width);
  Put(file, camera.height, camera.params.empty() ? '\n' : ' ');
  for (std::size_t i = 0; i < camera.params.size(); ++i) {
    Put(file, camera.params[i], i + 1 == camera.params.size() ? '\n' : ' ');
  }
}

void WriteImage(AtomicFile* file, const SparseImage& image) {
  Put(file, image.image_id);
  const Eigen::Quaterniond& q = image.rotation;
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) Put(file, value);
  for (const double value : image.translation) Put(file, value);
  Put(file, image.camera_id);
  file->Write(image.name + "\n");
  for (std::size_t i = 0; i < image.observations.size(); ++i) {
    const Observation& observation = image.observations[i];
    if (i > 0) file->Write(" ");
    Put(file, observation.x);
    Put(file, observation.y);
    file->Write(observation.point3D_id == kInvalidPoint3D ? "-1" : std::to_string(observation.point3D_id));
  }
  file->Write("\n");
}

void WritePoint(AtomicFile* file, const SparsePoint& point) {
  Put(file, point.point3D_id);
  for (const double value : point.xyz) Put(file, value);
  for (const std::uint8_t value : point.rgb) Put(file, int{value});
  Put(file, point.error, point.track.empty() ? '\n' : ' ');
  for (std::size_t i = 0; i < point.track.size(); ++i) {
    Put(file, point.track[i].image_id);
    Put(file, point.track[i].observation_index, i + 1 == point.track.size() ? '\n' : ' ');
  }
}

}  // namespace

SparseModel ReadSparseModelText(const fs::path& folder, ProblemList* problems, ModelPart part) {
  SparseModelBuilder builder(problems);
  const auto is_read = [&](const fs::path& path) { return part == ModelPart::kAll || fs::exists(path); };
  if (const fs::path cameras = folder / "cameras.txt"; is_read(cameras)) ReadCameras(cameras, &builder);
  if (const fs::path images = folder / "images.txt"; is_read(images)) ReadImages(images, &builder);
  if (const fs::path points = folder / "points3D.txt"; is_read(points)) ReadPoints(points, part, &builder);
  return builder.Finish();
}

void WriteSparseModelText(const SparseModel& model, const fs::path& folder) {
  AtomicFile points(folder / "points3D.txt");
  PutHeader(&points, "POINT3D_ID X Y Z R G B ERROR (IMAGE_ID OBSERVATION_INDEX)...", "points",
            model.points.size());
  for (const SparsePoint& point : model.points) WritePoint(&points, point);
  WriteViewsText(model, folder, &points);
}

void WriteViewsText(const SparseModel& model, const fs::path& folder, AtomicFile* points) {
  AtomicFile cameras(folder / "cameras.txt"), images(folder / "images.txt");
  PutHeader(&cameras, "CAMERA_ID MODEL WIDTH HEIGHT PARAMS...", "cameras", model.cameras.size());
  for (const auto& [id, camera] : model.cameras) WriteCamera(&cameras, camera);
  PutHeader(&images, "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, next line: (X Y POINT3D_ID)...", "images",
            model.images.size());
  for (const SparseImage& image : model.images) WriteImage(&images, image);
  PublishModel(folder, ".txt", {points, &cameras, &images});
}

}  // namespace colmap_ext
