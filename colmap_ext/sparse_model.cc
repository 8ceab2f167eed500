#include "colmap_ext/sparse_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "colmap_ext/format_text.h"
#include "colmap_ext/sparse_model_builder.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

struct CameraModel {
  int id;
  std::string_view name;
  std::size_t num_params;
};

constexpr CameraModel kCameraModels[] = {
    {0, "SIMPLE_PINHOLE", 3},
    {1, "PINHOLE", 4},
    {2, "SIMPLE_RADIAL", 4},
    {3, "RADIAL", 5},
    {4, "OPENCV", 8},
    {5, "OPENCV_FISHEYE", 8},
    {6, "FULL_OPENCV", 12},
    {7, "FOV", 5},
    {8, "SIMPLE_RADIAL_FISHEYE", 4},
    {9, "RADIAL_FISHEYE", 5},
    {10, "THIN_PRISM_FISHEYE", 12},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16},
    {12, "SIMPLE_DIVISION", 4},
    {13, "DIVISION", 5},
    {14, "SIMPLE_FISHEYE", 3},
    {15, "FISHEYE", 4},
    {16, "EUCM", 6},
    {17, "EQUIRECTANGULAR", 2},
};

// In world units: the Earth's radius is 6.4e9 millimetres. Where one pose is, the middle of all follows, and coordinates lose digits.
constexpr double kFarthestCamera = 1e12;
constexpr std::uint64_t kMaxImageSide = 1 << 20;  // pixels; more is damage

const CameraModel* FindCameraModel(int model_id) {
  for (const CameraModel& model : kCameraModels) {
    if (model.id == model_id) return &model;
  }
  return nullptr;
}

bool HasAllFiles(const fs::path& folder, const char* extension) {
  for (const char* stem : {"cameras", "images", "points3D"}) {
    if (!fs::exists(folder / (std::string(stem) + extension))) return false;
  }
  return true;
}

// Poses that are given come without points.
void RequirePointFile(const fs::path& folder, const std::string& extension) {
  const fs::path points = folder / ("points3D" + extension);
  if (fs::exists(points) || !fs::exists(folder / ("cameras" + extension)) || !fs::exists(folder / ("images" + extension))) return;
  throw phi::InputError(phi::AboutFile(points) + ": this file of the sparse model is missing; copy it, too. Where there are no points, " +
                        (extension == ".txt" ? "an empty file will do" : "write the model as .txt, with an empty points3D.txt"));
}

[[noreturn]] void ThrowNoModel(const fs::path& folder) {
  for (const char* extension : {".bin", ".txt"}) RequirePointFile(folder, extension);
  phi::Message message =
      phi::AboutFile(folder) + ": no sparse model here (cameras, images and points3D as .bin or .txt)";
  if (HasAllFiles(folder / "0", ".bin") || HasAllFiles(folder / "0", ".txt")) {
    message.text += "; there is one in " + (folder / "0").string() +
               ", as mapper leaves it: run colmap image_undistorter on it and use its output as workspace";
  } else {
    message.text += "; give the folder that colmap image_undistorter wrote";
  }
  throw phi::InputError(message);
}

bool AllFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

std::string CameraProblem(const SparseCamera& camera) {
  const auto num_params = NumCameraParams(camera.model_id);
  if (num_params && camera.params.size() != *num_params) {
    return "has " + std::to_string(camera.params.size()) + " parameters, but " +
           CameraModelName(camera.model_id) + " needs " + std::to_string(*num_params);
  }
  if (camera.width < 1 || camera.height < 1 || camera.width > kMaxImageSide ||
      camera.height > kMaxImageSide) {
    return "has an impossible size of " + SizeText(camera.width, camera.height) + " pixels";
  }
  if (!AllFinite(camera.params)) return "has a parameter that is not a finite number";
  return "";
}

}  // namespace

phi::Message ModelPosition::Text() const {
  return phi::AboutFile(*file) + ": " + unit + " " + std::to_string(number) + ": ";
}

void PublishModel(const fs::path& folder, const std::string& suffix, const std::array<AtomicFile*, 3>& files) {
  for (AtomicFile* file : files) file->Complete();
  for (const char* name : {"frames", "rigs"}) fs::remove(folder / (name + suffix));
  for (AtomicFile* file : files) file->Commit();
}

std::string CameraModelName(int model_id) {
  const CameraModel* model = FindCameraModel(model_id);
  return model ? std::string(model->name) : "unknown camera model " + std::to_string(model_id);
}

std::optional<std::size_t> NumCameraParams(int model_id) {
  const CameraModel* model = FindCameraModel(model_id);
  return model ? std::optional(model->num_params) : std::nullopt;
}

std::optional<int> CameraModelIdFromName(std::string_view name) {
  for (const CameraModel& model : kCameraModels) {
    if (model.name == name) return model.id;
  }
  return std::nullopt;
}

void SparseModelBuilder::Report(const ModelPosition& position, const phi::Message& message) {
  ReportProblem(problems_, position.Text() + message);
}

void SparseModelBuilder::AddCamera(SparseCamera camera, const ModelPosition& position) {
  const std::string who = "camera " + std::to_string(camera.camera_id) + " ";
  if (const std::string problem = CameraProblem(camera); !problem.empty()) {
    Report(position, who + problem);
  } else if (!model_.cameras.emplace(camera.camera_id, std::move(camera)).second) {
    Report(position, who + "appears twice");
  }
}

std::string SparseModelBuilder::ImageProblem(const SparseImage& image) const {
  if (image.name.empty()) return "has no name";
  if (num_observations_.contains(image.image_id)) return "has an id that another image has too";
  if (!model_.cameras.contains(image.camera_id)) {
    return "uses camera " + std::to_string(image.camera_id) + ", which is not among the cameras";
  }
  const double norm = image.rotation.norm();
  if (!std::isfinite(norm) || norm < 1e-6) return "has a rotation that is no quaternion";
  if (!image.translation.allFinite()) return "has a translation that is not finite";
  if (image.translation.norm() > kFarthestCamera) return "has an impossible translation, farther than any scene reaches";
  return "";
}

void SparseModelBuilder::AddImage(SparseImage image, const ModelPosition& position) {
  if (const std::string problem = ImageProblem(image); !problem.empty()) {
    Report(position, "image " + std::to_string(image.image_id) + " '" + phi::AboutImage(image.name) + "' " + problem +
                         "; export or undistort the model again, or take the image out of it");
    dropped_images_.insert(image.image_id);
    return;
  }
  num_observations_.emplace(image.image_id, image.observations.size());
  model_.images.push_back(std::move(image));
}

const TrackElement* SparseModelBuilder::FindWrongElement(const SparsePoint& point) const {
  for (const TrackElement& element : point.track) {
    const auto found = num_observations_.find(element.image_id);
    const bool is_wrong =
        found == num_observations_.end() ? !dropped_images_.contains(element.image_id) : element.observation_index >= found->second;
    if (is_wrong) return &element;
  }
  return nullptr;
}

phi::Message SparseModelBuilder::Describe(std::uint32_t image_id, const WrongPoints& points) const {
  const std::string image = "image " + std::to_string(image_id), first = "point " + std::to_string(points.point3D_id);
  const auto found = num_observations_.find(image_id);
  if (found == num_observations_.end()) {
    const std::string why = image + ", which is not among the images";
    if (points.count == 1) return points.position + first + " was seen in " + why;
    return points.position + std::to_string(points.count) + " points name " + why + ", " + first + " the first";
  }
  const std::string why = "of " + image + ", which has only " + std::to_string(found->second);
  if (points.count == 1) return points.position + first + " is observation " + std::to_string(points.observation_index) + " " + why;
  return points.position + std::to_string(points.count) + " points are observations " + why + ", " + first + " the first";
}

// A triangulation that went wrong says nothing and costs nothing: the image's other points are enough.
void SparseModelBuilder::AddPoint(SparsePoint point, const ModelPosition& position) {
  if (!point.xyz.allFinite()) {
    if (num_points_nowhere_++ == 0) first_point_nowhere_ = position.Text();
    return;
  }
  if (const TrackElement* wrong = FindWrongElement(point); wrong != nullptr) {
    WrongPoints& points = wrong_points_[wrong->image_id];
    if (points.count++ == 0) {
      points.point3D_id = point.point3D_id;
      points.observation_index = wrong->observation_index;
      points.position = position.Text();
    }
    if (problems_ == nullptr) throw phi::InputError(Describe(wrong->image_id, points));
    return;
  }
  if (!dropped_images_.empty()) {
    std::erase_if(point.track,
                  [&](const TrackElement& e) { return !num_observations_.contains(e.image_id); });
  }
  model_.points.push_back(std::move(point));
}

SparseModel SparseModelBuilder::Finish() {
  for (const auto& [image_id, points] : wrong_points_) ReportProblem(problems_, Describe(image_id, points));
  if (num_points_nowhere_ > 0) {
    phi::LogWarning(first_point_nowhere_ + "the first of " + std::to_string(num_points_nowhere_) +
                    " points whose position is not finite; they are left out");
  }
  return std::move(model_);
}

fs::path CamerasFile(const fs::path& folder) { return folder / (HasAllFiles(folder, ".bin") ? "cameras.bin" : "cameras.txt"); }

SparseModel ReadSparseModel(const fs::path& folder, ProblemList* problems) {
  if (HasAllFiles(folder, ".bin")) return ReadSparseModelBinary(folder, problems);
  if (HasAllFiles(folder, ".txt")) return ReadSparseModelText(folder, problems);
  ThrowNoModel(folder);
}

SparseModel ReadModelHead(const fs::path& folder, const std::string& suffix) {
  const auto read = suffix == ".bin" ? ReadSparseModelBinary : ReadSparseModelText;
  return read(folder, nullptr, ModelPart::kHead);
}

}  // namespace colmap_ext
