#include "colmap_ext/workspace.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <climits>
#include <set>
#include <utility>

#include "colmap_ext/dead_link.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/moved_image.h"
#include "colmap_ext/pinhole_camera.h"
#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// The folder of a workspace in memory: nothing can be below it.
constexpr char kNoFolder[] = "/dev/null/memory";

void CheckOptions(const WorkspaceOptions& options) {
  const std::string format = Lowercase(options.format);
  if (format == "pmvs") {
    throw phi::UsageError(
        "--workspace_format PMVS is not supported: run colmap image_undistorter with --output_type COLMAP "
        "and use "
        "that workspace");
  }
  if (format != "colmap") throw phi::UsageError("--workspace_format " + options.format + ": must be COLMAP");
  if (!fs::is_directory(options.path)) {
    throw phi::InputError(
        phi::AboutFile(options.path) +
        ": --workspace_path must be an existing folder, as colmap image_undistorter writes it");
  }
  if (!options.mask_path.empty() && !fs::is_directory(options.mask_path)) {
    throw phi::InputError("--PhiStereo.mask_path: there is no folder " + phi::AboutFile(options.mask_path));
  }
  if (const std::string dead = DescribeDeadLink(options.path / "sparse"); !dead.empty()) {
    throw phi::InputError(phi::AboutFile(options.path) + ": " + dead);
  }
  if (!fs::is_directory(options.path / "sparse")) {
    throw phi::InputError(
        phi::AboutFile(options.path) +
        ": has no folder 'sparse'; --workspace_path must be what colmap image_undistorter wrote, with --output_type COLMAP");
  }
}

// The pixels of a reduced image that a full-size pixel lies in.
struct Covered {
  int first, last;
};
Covered WorkingPixels(int full_pixel, int full_size, int working_size) {
  const auto first = std::int64_t{full_pixel} * working_size / full_size;
  const auto last = ((std::int64_t{full_pixel} + 1) * working_size - 1) / full_size;
  return {static_cast<int>(first), static_cast<int>(last)};
}

// What maps' names have after the image's.
constexpr std::size_t kLongestSuffix = std::string_view(".photometric.bin").size();

// Image names become file names below images/ and stereo/.
std::string NameProblem(const std::string& name) {
  const fs::path path(name);
  if (path.is_absolute()) return "is an absolute path";
  if (std::find(path.begin(), path.end(), "..") != path.end()) return "leads out of the workspace";
  if (path.filename().empty()) return "ends in a slash";
  constexpr std::size_t kMost = NAME_MAX - kLongestSuffix;
  if (const std::size_t size = path.filename().native().size(); size > kMost) {
    return "has a file name that is too long: " + std::to_string(size) + " bytes, at most " + std::to_string(kMost) +
           " leave room for what names of maps add";
  }
  if (name.find_first_of("\r\n") != std::string::npos) return "holds a line break";
  if (name.find('\0') != std::string::npos) return "holds a NUL byte";
  return "";
}

using NameOfFile = std::unordered_map<std::string, std::string>;

std::string FileOf(const std::string& name) { return fs::path(name).lexically_normal().string(); }

// The mask that goes with a kind of map has the kind in its name, the mask of the geometric map none: that of the image
// a.measured is where a's measured mask is, and each stage would take the other image's.
void ReportSharedMasks(const SparseModel& model, const NameOfFile& name_of_file, const phi::Message& origin,
                       ProblemList* problems) {
  for (const SparseImage& image : model.images) {
    const std::string file = FileOf(image.name);
    for (const std::string_view kind : {kPhotometric, kMeasured, kRaw, kShared, kInferred}) {
      const std::string suffix = "." + std::string(kind);
      if (!file.ends_with(suffix)) continue;
      const auto other = name_of_file.find(file.substr(0, file.size() - suffix.size()));
      if (other == name_of_file.end()) continue;
      ReportProblem(problems, origin + ": the images '" + other->second + "' and '" + image.name +
                                  "' would have the same mask in stereo/filled_masks, '" + file + ".png'; rename one of them");
    }
  }
}

// Those that no image uses may be anything.
std::set<std::uint32_t> ReportCameras(const SparseModel& model, const phi::Message& origin,
                                      ProblemList* problems) {
  std::set<std::uint32_t> used, refused;
  for (const SparseImage& image : model.images) used.insert(image.camera_id);
  for (const auto& [id, camera] : model.cameras) {
    const std::string problem = used.contains(id) ? PinholeProblem(camera) : "";
    if (problem.empty()) continue;
    refused.insert(id);
    ReportProblem(problems, origin + ": " + problem);
  }
  return refused;
}

}  // namespace

phi::OptionList WorkspaceOptions::FolderList() {
  constexpr const char* kSameMaps = "the maps are the same";
  phi::OptionList list;
  list.Add("workspace_path", &path, "Folder that colmap image_undistorter wrote, or the one above it")
      .Required()
      .NotInKey(kSameMaps);
  list.Add("workspace_format", &format, "Format of the workspace {COLMAP}").ColmapDefault("COLMAP").NotInKey(kSameMaps);
  return list;
}

phi::OptionList WorkspaceOptions::List() {
  constexpr const char* kInInputs = "the keys hold the working cameras and samples of the masks";
  phi::OptionList list = FolderList();
  list.Add("PatchMatchStereo.max_image_size", &max_image_size, "Work on smaller images: longest side; -1 = full size")
      .Unit("pixels")
      .ColmapDefault("-1")
      .AtLeast(-1)
      .NotInKey(kInInputs);
  list.Add("PhiStereo.mask_path", &mask_path,
           "Folder of masks named <image name>.png; where a mask is 0 the image is left out")
      .NotInKey(kInInputs);
  return list;
}

Workspace::Workspace(const WorkspaceOptions& options, ProblemList* problems)
    : path_(options.path), mask_path_(options.mask_path) {
  CheckOptions(options);
  const fs::path sparse = path_ / "sparse";
  model_ = ReadSparseModel(sparse, problems);
  if (model_.images.empty())
    ReportProblem(problems, phi::AboutFile(sparse) + ": the sparse model has no images; export or undistort it again");
  MakeViews({phi::AboutFile(sparse), phi::AboutFile(CamerasFile(sparse))}, options.max_image_size, problems);
}

Workspace::Workspace(SparseModel model, std::vector<MemoryImage> images, int max_image_size)
    : path_(kNoFolder), memory_images_(std::move(images)), model_(std::move(model)) {
  if (model_.images.empty()) throw phi::InputError("there are no images");
  MakeViews({"the scene", "the scene"}, max_image_size, nullptr);
  for (std::size_t i = 0; i < memory_images_.size(); ++i) {
    views_[i].camera.pose = memory_images_[i].pose;
    const SparseCamera& camera = model_.cameras.at(model_.images[i].camera_id);
    const auto check = [&](const auto& picture, const char* what) {
      if (picture == nullptr || (static_cast<std::uint64_t>(picture->width()) == camera.width &&
                                 static_cast<std::uint64_t>(picture->height()) == camera.height)) {
        return;
      }
      throw phi::InputError("image " + phi::AboutImage(views_[i].name) + ": its " + what + " is " +
                            SizeText(picture->width(), picture->height()) + " pixels, but its camera " +
                            SizeText(camera.width, camera.height));
    };
    check(memory_images_[i].gray, "photo");
    check(memory_images_[i].color, "photo");
    check(memory_images_[i].mask, "mask");
  }
}

void Workspace::MakeViews(const Origin& origin, int max_image_size, ProblemList* problems) {
  const std::set<std::uint32_t> refused_cameras = ReportCameras(model_, origin.cameras, problems);
  views_.reserve(model_.images.size());
  NameOfFile name_of_file;
  for (const SparseImage& image : model_.images) {
    if (const std::string problem = NameProblem(image.name); !problem.empty()) {
      ReportProblem(problems, origin.model + ": the image name '" + phi::AboutImage(image.name.c_str()) + "' " + problem +
                                  "; rename it");
    }
    if (!index_by_name_.emplace(image.name, static_cast<int>(views_.size())).second) {
      ReportProblem(problems, origin.model + ": two images are named '" + phi::AboutImage(image.name) +
                                  "'; take one of them out of the model");
    } else if (const auto [same, is_new] =
                   name_of_file.emplace(FileOf(image.name), image.name);
               !is_new) {
      ReportProblem(problems, origin.model + ": the images '" + same->second + "' and '" + image.name +
                                  "' have the same file; take one of them out of the model");
    }
    phi::SceneView view;
    view.name = image.name;
    view.image_id = image.image_id;
    if (!refused_cameras.contains(image.camera_id)) {
      view.camera.pinhole =
          DownsizedPinhole(MakePinhole(model_.cameras.at(image.camera_id)), max_image_size);
    }
    view.camera.pose.rotation = image.rotation.normalized().toRotationMatrix();
    view.camera.pose.translation = image.translation;
    views_.push_back(std::move(view));
  }
  if (!IsInMemory()) ReportSharedMasks(model_, name_of_file, origin.model, problems);
}

void Workspace::DropObservations() {
  for (SparseImage& image : model_.images) std::vector<Observation>().swap(image.observations);
#ifdef __GLIBC__
  ::malloc_trim(0);  // what lies between pieces in use would stay with this thread's heap, which workers do not take from
#endif
}

std::int64_t Workspace::LargestImage() const {
  std::int64_t largest = 0;
  for (const phi::SceneView& view : views_)
    largest = std::max(largest, std::int64_t{view.camera.pinhole.width} * view.camera.pinhole.height);
  return largest;
}

int Workspace::FindImage(std::string_view name) const {
  const auto found = index_by_name_.find(std::string(name));
  return found == index_by_name_.end() ? -1 : found->second;
}

fs::path Workspace::ImagePath(int image) const { return path_ / "images" / views_[image].name; }

fs::path Workspace::DepthMapPath(int image, std::string_view kind) const {
  return StereoFolder() / "depth_maps" / (views_[image].name + "." + std::string(kind) + ".bin");
}

fs::path Workspace::NormalMapPath(int image, std::string_view kind) const {
  return StereoFolder() / "normal_maps" / (views_[image].name + "." + std::string(kind) + ".bin");
}

fs::path Workspace::CostMapPath(int image, std::string_view kind) const {
  return StereoFolder() / "cost_maps" / (views_[image].name + "." + std::string(kind) + ".bin");
}

fs::path Workspace::ConfidenceMapPath(int image, std::string_view kind) const {
  return ConfidenceMapsFolder() / (views_[image].name + "." + std::string(kind) + ".bin");
}

fs::path Workspace::FilledMaskPath(int image) const {
  return StereoFolder() / "filled_masks" / (views_[image].name + ".png");
}

fs::path Workspace::FilledMaskPath(int image, std::string_view kind) const {
  const fs::path path = FilledMaskPath(image);
  if (kind == kGeometric) return path;
  return path.parent_path() / (path.stem().string() + "." + std::string(kind) + path.extension().string());
}

fs::path Workspace::MaskPathIn(const fs::path& folder, int image) const { return folder / (views_[image].name + ".png"); }

fs::path Workspace::ImageMaskPath(int image) const {
  return mask_path_.empty() ? fs::path() : MaskPathIn(mask_path_, image);
}

std::shared_ptr<const PhotoFile> Workspace::ReadPhoto(int image) const {
  return std::make_shared<const PhotoFile>(ReadPhotoFile(ImagePath(image)));
}

template <typename Image>
Image Workspace::ReadFullSize(int image, const PhotoFile* photo,
                              Image (*decode)(const PhotoFile&, const CheckSize&)) const {
  const fs::path path = ImagePath(image);
  const SparseCamera& camera = model_.cameras.at(model_.images[image].camera_id);
  return decode(photo != nullptr ? *photo : ReadPhotoFile(path), [&](std::size_t width, std::size_t height) {
    if (width == camera.width && height == camera.height) return;
    const bool is_turned = width == camera.height && height == camera.width;
    throw phi::InputError(
        phi::AboutFile(path) + ": the image is " + SizeText(width, height) + " pixels but its camera " +
        std::to_string(camera.camera_id) + " is " + SizeText(camera.width, camera.height) +
        (is_turned ? ": its sides are swapped, as by a program that turned it by its EXIF orientation; put back the image that colmap "
                     "image_undistorter wrote"
                   : "; put back the image that colmap image_undistorter wrote. With --max_image_size it shrinks images but not the "
                     "cameras of photos without distortion: leave that out there, and use --PatchMatchStereo.max_image_size here"));
  });
}

std::shared_ptr<const phi::GrayImage> Workspace::ReadGray(int image, const PhotoFile* photo) const {
  const auto gray = ReadUnmovedGray(image, photo);
  const phi::ImageCorrection* correction = Correction(image);
  return correction == nullptr ? gray : std::make_shared<const phi::GrayImage>(MoveImage(*gray, *correction));
}

std::shared_ptr<const phi::GrayImage> Workspace::ReadUnmovedGray(int image, const PhotoFile* photo) const {
  const phi::Pinhole& working = views_[image].camera.pinhole;
  if (IsInMemory()) {
    const auto& gray = memory_images_[image].gray;
    if (gray->width() == working.width && gray->height() == working.height) return gray;
    return std::make_shared<const phi::GrayImage>(Resize(*gray, working.width, working.height));
  }
  return std::make_shared<const phi::GrayImage>(
      Resize(ReadFullSize(image, photo, &DecodeGray), working.width, working.height));
}

bool Workspace::HasImageMask(int image) const {
  if (IsInMemory()) return memory_images_[image].mask != nullptr;
  const fs::path path = ImageMaskPath(image);
  return !path.empty() && fs::exists(path);
}

std::shared_ptr<const phi::ImageMask> Workspace::ReadImageMask(int image) const {
  if (!HasImageMask(image)) return nullptr;
  const fs::path path = ImageMaskPath(image);
  const SparseCamera& camera = model_.cameras.at(model_.images[image].camera_id);
  const auto check_size = [&](std::size_t width, std::size_t height) {
    if (width == camera.width && height == camera.height) return;
    throw phi::InputError(phi::AboutFile(path) + ": the mask is " + SizeText(width, height) + " pixels but its image is " +
                          SizeText(camera.width, camera.height) +
                          "; make masks of the undistorted images");
  };
  const phi::GrayImage full = IsInMemory() ? *memory_images_[image].mask : ReadImageMaskFile(path, check_size);
  check_size(full.width(), full.height());
  const phi::Pinhole& working = views_[image].camera.pinhole;
  auto mask = std::make_shared<phi::ImageMask>(working.width, working.height, 255);
  for (int y = 0; y < full.height(); ++y) {
    const Covered rows = WorkingPixels(y, full.height(), working.height);
    for (int x = 0; x < full.width(); ++x) {
      if (full(x, y) != 0) continue;
      const Covered columns = WorkingPixels(x, full.width(), working.width);
      for (int v = rows.first; v <= rows.last; ++v) {
        for (int u = columns.first; u <= columns.last; ++u) (*mask)(u, v) = 0;
      }
    }
  }
  return mask;
}

ColorImage Workspace::ReadColor(int image, int width, int height, const PhotoFile* photo) const {
  if (IsInMemory()) {
    const MemoryImage& in_memory = memory_images_[image];
    if (in_memory.color != nullptr) return Resize(*in_memory.color, width, height);
    ColorImage color(in_memory.gray->width(), in_memory.gray->height());
    std::transform(in_memory.gray->begin(), in_memory.gray->end(), color.begin(), [](std::uint8_t g) { return Rgb{g, g, g}; });
    return Resize(std::move(color), width, height);
  }
  return Resize(ReadFullSize(image, photo, &DecodeColor), width, height);
}

}  // namespace colmap_ext
