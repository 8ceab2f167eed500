#include "colmap_ext/rig_frames.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>

#include "colmap_ext/input_file.h"
#include "colmap_ext/text_stream.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// Poses that are so near differ by rounding: radian, and share of the cameras' extent or, where they stand at one place, of a
// thousandth of their distance from the origin.
constexpr double kSameRotation = 1e-4, kSameCenter = 1e-5;

struct FileDamage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The records of a .bin file, from its count of them on.
class BinaryRecords {
 public:
  explicit BinaryRecords(std::string content)
      : content_(std::move(content)), num_left_(Number<std::uint64_t>()) {}

  bool Next() { return num_left_-- > 0; }
  template <typename T>
  T Number() {
    T value;
    if (content_.size() - position_ < sizeof(T)) throw FileDamage("it ends too early");
    std::memcpy(&value, content_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return value;
  }
  bool IsCamera() { return Number<std::int32_t>() == 0; }
  bool Flag() { return Number<std::uint8_t>() != 0; }

 private:
  std::string content_;
  std::size_t position_ = 0;
  std::uint64_t num_left_;
};

// The lines of a .txt file.
class TextRecords {
 public:
  explicit TextRecords(const std::string& content) : content_(content) {}

  bool Next() {
    for (std::string line; std::getline(content_, line);) {
      line_ = TextInput(line);
      const int first = (line_ >> std::ws).peek();
      if (first != TextInput::traits_type::eof() && first != '#') return true;
    }
    return false;
  }
  template <typename T>
  T Number() {
    T value;
    if (!(line_ >> value)) throw FileDamage("a line has too few numbers");
    return value;
  }
  bool IsCamera() {
    std::string type;
    return line_ >> type && type == "CAMERA";
  }
  bool Flag() { return Number<int>() != 0; }

 private:
  TextInput content_, line_;
};

// A sensor of a rig, and its pose where it is known. The reference sensor's is the rig's own.
using SensorId = std::pair<bool, std::uint32_t>;  // whether it is a camera
using Rig = std::map<SensorId, std::optional<Eigen::Isometry3d>>;

template <typename Records>
SensorId ReadSensorId(Records* records) {
  const bool is_camera = records->IsCamera();
  return {is_camera, records->template Number<std::uint32_t>()};
}

template <typename Records>
Eigen::Isometry3d ReadPose(Records* records) {
  double v[7];
  for (double& value : v) value = records->template Number<double>();
  return Eigen::Translation3d(v[4], v[5], v[6]) * Eigen::Quaterniond(v[0], v[1], v[2], v[3]).normalized();
}

template <typename Records>
std::map<std::uint32_t, Rig> ReadRigs(Records records) {
  std::map<std::uint32_t, Rig> rigs;
  while (records.Next()) {
    Rig& rig = rigs[records.template Number<std::uint32_t>()];
    const auto num_sensors = records.template Number<std::uint32_t>();
    for (std::uint32_t i = 0; i < num_sensors; ++i) {
      std::optional<Eigen::Isometry3d>& pose = rig[ReadSensorId(&records)];
      if (i == 0) {
        pose = Eigen::Isometry3d::Identity();
      } else if (records.Flag()) {
        pose = ReadPose(&records);
      }
    }
  }
  return rigs;
}

// By image id: the image's pose.
using Poses = std::map<std::uint32_t, Eigen::Isometry3d>;

template <typename Records>
Poses ReadPoses(Records records, const std::map<std::uint32_t, Rig>& rigs) {
  Poses poses;
  while (records.Next()) {
    records.template Number<std::uint32_t>();  // the frame's id
    const auto rig = rigs.find(records.template Number<std::uint32_t>());
    if (rig == rigs.end()) throw FileDamage("it names a rig that is not among the rigs");
    const Eigen::Isometry3d rig_from_world = ReadPose(&records);
    const auto num_data = records.template Number<std::uint32_t>();
    for (std::uint32_t i = 0; i < num_data; ++i) {
      const SensorId sensor = ReadSensorId(&records);
      const auto image_id = records.template Number<std::uint64_t>();
      const auto pose = rig->second.find(sensor);
      if (!sensor.first || pose == rig->second.end() || !pose->second) continue;
      poses[static_cast<std::uint32_t>(image_id)] = *pose->second * rig_from_world;
    }
  }
  return poses;
}

std::string Content(const fs::path& path) {
  std::ifstream file = OpenRegularFile(path);
  if (!file) throw FileDamage("it cannot be opened");
  return {std::istreambuf_iterator<char>(file), {}};
}

Eigen::Isometry3d PoseOf(const SparseImage& image) {
  return Eigen::Translation3d(image.translation) * image.rotation.normalized();
}

Eigen::Vector3d CenterOf(const Eigen::Isometry3d& pose) { return pose.inverse().translation(); }

// Indices into model.images.
std::vector<std::size_t> ImagesWithOtherPoses(const SparseModel& model, const Poses& poses) {
  Eigen::AlignedBox3d extent;
  double farthest = 0;
  for (const SparseImage& image : model.images) {
    const Eigen::Vector3d center = CenterOf(PoseOf(image));
    extent.extend(center);
    farthest = std::max(farthest, center.norm());
  }
  const double tolerance =
      model.images.empty() ? 0 : kSameCenter * std::max(extent.diagonal().norm(), 1e-3 * farthest);
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    const auto known = poses.find(model.images[i].image_id);
    const Eigen::Isometry3d own = PoseOf(model.images[i]);
    const bool is_same =
        known != poses.end() &&
        Eigen::AngleAxisd(own.rotation() * known->second.rotation().transpose()).angle() < kSameRotation &&
        (CenterOf(own) - CenterOf(known->second)).norm() <= tolerance;
    if (!is_same) others.push_back(i);
  }
  return others;
}

template <typename Records>
Poses ReadPosesOf(const fs::path& rigs, const fs::path& frames) {
  return ReadPoses(Records(Content(frames)), ReadRigs(Records(Content(rigs))));
}

}  // namespace

std::string FramesWarning(const fs::path& folder, const SparseModel& model) {
  const std::string suffix = fs::exists(folder / "images.bin") ? ".bin" : ".txt";
  const fs::path rigs = folder / ("rigs" + suffix), frames = folder / ("frames" + suffix);
  if (!fs::exists(rigs) && !fs::exists(frames)) return "";
  const std::string images = "images" + suffix, remedy = "; take rigs" + suffix + " and frames" + suffix +
                                                         " away if " + images + " is right";
  try {
    const Poses poses =
        suffix == ".bin" ? ReadPosesOf<BinaryRecords>(rigs, frames) : ReadPosesOf<TextRecords>(rigs, frames);
    const std::vector<std::size_t> others = ImagesWithOtherPoses(model, poses);
    if (others.empty()) return "";
    return frames.string() + ": " + std::to_string(others.size()) + " of " +
           std::to_string(model.images.size()) + " images, '" + model.images[others.front()].name +
           "' the first, have another pose here than in " + images + ", or none. phimvs takes those of " +
           images + ", COLMAP 3.12 and later take these" + remedy +
           ", else write the model anew with colmap model_converter of such a COLMAP";
  } catch (const FileDamage& damage) {
    return frames.string() + " and rigs" + suffix + " do not make a model: " + damage.what() +
           ". phimvs takes the poses of " + images + ", COLMAP 3.12 and later cannot read this" + remedy;
  }
}

void WarnOfFrames(const Workspace& workspace) {
  const std::string warning = FramesWarning(workspace.path() / "sparse", workspace.model());
  if (!warning.empty()) phi::LogWarning(warning);
}

}  // namespace colmap_ext
