#include "colmap_ext/workspace_check.h"

#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <optional>
#include <set>
#include <system_error>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/compact_map.h"
#include "colmap_ext/dead_link.h"
#include "colmap_ext/dim_photos.h"
#include "colmap_ext/folder_files.h"
#include "colmap_ext/format_text.h"
#include "colmap_ext/fusion_config.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/map_scale.h"
#include "colmap_ext/mask_check.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/missing_images.h"
#include "colmap_ext/patch_match_config.h"
#include "colmap_ext/pinhole_camera.h"
#include "colmap_ext/pipeline/image_jobs.h"
#include "colmap_ext/pipeline/image_moves.h"
#include "colmap_ext/pipeline/result_files.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/run_status.h"
#include "colmap_ext/rig_frames.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// Depth and normal in single precision.
constexpr std::uint64_t kMapBytesPerPixel = 4 * sizeof(float);
constexpr std::string_view kMapKinds[] = {kPhotometric, kMeasured, kGeometric};

// The action's problem, if it has one.
template <typename Action>
void Try(ProblemList* errors, const Action& action) {
  try {
    action();
  } catch (const phi::InputError& error) {
    errors->push_back(error.what());
  }
}

bool HasCamera(const Workspace& workspace, int image) {
  return workspace.views()[image].camera.pinhole.width > 0;  // else its camera is reported already
}

void CheckImages(const Workspace& workspace, ProblemList* errors, ProblemList* warnings) {
  if (const phi::Message problem = DescribeMissingImages(workspace); !problem.empty()) {
    errors->push_back(problem);
    return;
  }
  const int count = static_cast<int>(workspace.views().size());
  std::vector<ProblemList> errors_of_image(count);
  std::vector<int> all(count);
  std::iota(all.begin(), all.end(), 0);
  DimPhotos photos(workspace, all);
  tbb::parallel_for(0, count, [&](int image) {
    Try(&errors_of_image[image], [&] {
      const auto photo = workspace.ReadPhoto(image);
      photos.Look(image, *photo);
      if (HasCamera(workspace, image)) {
        workspace.ReadGray(image, photo.get());
      } else {
        DecodeGray(*photo);
      }
    });
  });
  for (const ProblemList& list : errors_of_image) errors->insert(errors->end(), list.begin(), list.end());
  if (const std::string dim = photos.Describe(); !dim.empty()) warnings->push_back(dim);
}

void CheckPoints(const Workspace& workspace, WorkspaceReport* report) {
  const SparseModel& model = workspace.model();
  if (model.points.empty()) {
    report->warnings.push_back(
        (workspace.path() / "sparse").string() +
        ": the model has no points; source images and depth ranges follow from the cameras "
        "alone, which is less accurate");
    return;
  }
  const auto sees_no_point = [](const SparseImage& image) {
    return std::none_of(image.observations.begin(), image.observations.end(),
                        [](const Observation& o) { return o.point3D_id != kInvalidPoint3D; });
  };
  const auto first = std::find_if(model.images.begin(), model.images.end(), sees_no_point);
  if (first == model.images.end()) return;
  const auto count = std::count_if(first, model.images.end(), sees_no_point);
  report->warnings.push_back(workspace.path().string() + ": " + std::to_string(count) + " of " +
                             std::to_string(model.images.size()) + " images see no sparse point, '" + first->name +
                             "' the first; their source images and depth ranges are guesses");
}

void CheckPoses(const Workspace& workspace, WorkspaceReport* report) {
  const phi::SparseScene scene = MakeSparseScene(workspace.model());
  const std::string warning =
      PoseWarning(phi::FindImageCorrections(workspace.views(), scene, {}), scene, workspace);
  if (!warning.empty()) report->warnings.push_back((workspace.path() / "sparse").string() + ": " + warning);
}

const SparseCamera& CameraOf(const Workspace& workspace, int image) {
  return workspace.model().cameras.at(workspace.model().images[image].camera_id);
}

// A map may have any working resolution of its image's camera.
bool IsWorkingResolution(const MapSize& map, const SparseCamera& camera) {
  const phi::Pinhole full{static_cast<int>(camera.width), static_cast<int>(camera.height), 1, 1, 0, 0};
  const phi::Pinhole working = DownsizedPinhole(full, std::max(map.width, map.height));
  return working.width == map.width && working.height == map.height;
}

void CheckMapSize(const fs::path& path, const MapSize& size, int channels, const SparseCamera& camera,
                  ProblemList* errors) {
  if (size.channels != channels) {
    errors->push_back(path.string() + ": has " + std::to_string(size.channels) + " channels instead of " +
                      std::to_string(channels) + "; delete it and compute it again");
  }
  if (!IsWorkingResolution(size, camera)) {
    errors->push_back(path.string() + ": a map of " + SizeText(size.width, size.height) +
                      " pixels does not fit an image of " + std::to_string(camera.width) + "x" +
                      std::to_string(camera.height) + "; delete it and compute it again");
  }
}

void CheckMapsOfKind(const Workspace& workspace, int image, std::string_view kind, ProblemList* errors) {
  const fs::path depth = workspace.DepthMapPath(image, kind), normal = workspace.NormalMapPath(image, kind);
  const bool has_depth = fs::exists(depth), has_normal = fs::exists(normal);
  if (has_depth != has_normal) {
    errors->push_back((has_depth ? depth : normal).string() + ": there is no " +
                      (has_depth ? normal : depth).string() +
                      " to go with it; delete it or compute both again");
  }
  const SparseCamera& camera = CameraOf(workspace, image);
  std::optional<MapSize> depth_size, normal_size;
  if (has_depth) Try(errors, [&] { depth_size = ReadMapSize(depth); });
  if (has_normal) Try(errors, [&] { normal_size = ReadMapSize(normal); });
  if (depth_size) CheckMapSize(depth, *depth_size, 1, camera, errors);
  if (normal_size) CheckMapSize(normal, *normal_size, 3, camera, errors);
  if (depth_size && normal_size &&
      (depth_size->width != normal_size->width || depth_size->height != normal_size->height)) {
    errors->push_back(normal.string() + ": the normal map is " +
                      SizeText(normal_size->width, normal_size->height) + " but the depth map is " +
                      SizeText(depth_size->width, depth_size->height) +
                      "; delete both and compute them again");
  }
}

void CheckFilledMask(const Workspace& workspace, int image, ProblemList* errors) {
  const fs::path path = workspace.FilledMaskPath(image), depth = workspace.DepthMapPath(image, kGeometric);
  if (!fs::exists(path)) return;
  Try(errors, [&] {
    const phi::Mask mask = ReadMask(path);
    if (!fs::exists(depth)) return;
    const MapSize size = ReadMapSize(depth);
    if (mask.width() != size.width || mask.height() != size.height) {
      errors->push_back(path.string() + ": the mask is " + SizeText(mask.width(), mask.height()) +
                        " but the depth map is " + SizeText(size.width, size.height) +
                        "; delete both and compute them again");
    }
  });
}

// The whole of it: no other program would notice that it is damaged.
void CheckCompactMap(const Workspace& workspace, int image, const std::string& kind, const TaskRecord* task,
                     ProblemList* errors) {
  const fs::path path = CompactMapPath(workspace, image, kind);
  Try(errors, [&] {
    const phi::MeasurementMap map = ReadCompactMap(path);
    CheckMapSize(path, {map.width(), map.height(), 1}, 1, CameraOf(workspace, image), errors);
    if (StateOf(path, task) != FileState::kForeign) return;
    errors->push_back(path.string() +
                      ": was not made by phimvs in this workspace, or has changed since; delete it, or let "
                      "patch_match_stereo "
                      "--overwrite true replace it");
  });
  if (task == nullptr) return;
  for (const fs::path& other : {workspace.DepthMapPath(image, kind), workspace.NormalMapPath(image, kind)}) {
    if (StateOf(other, task) != FileState::kForeign) continue;
    errors->push_back(other.string() + ": was not made by phimvs, which reads " + path.string() +
                      " in its place; move one of the two away");
  }
}

void CheckCompactMaps(const Workspace& workspace, ProblemList* errors) {
  std::optional<RunRecord> record;
  Try(errors, [&] { record.emplace(workspace.StereoFolder()); });
  if (!record) return;
  for (int image = 0; image < static_cast<int>(workspace.views().size()); ++image) {
    for (const std::string_view view : kMapKinds) {
      const std::string kind(view);
      if (!fs::exists(CompactMapPath(workspace, image, kind))) continue;
      const auto task = record->Find(workspace.views()[image].name, kind);
      CheckCompactMap(workspace, image, kind, task ? &*task : nullptr, errors);
    }
  }
}

void CheckMaps(const Workspace& workspace, ProblemList* errors) {
  for (int image = 0; image < static_cast<int>(workspace.views().size()); ++image) {
    for (const std::string_view kind : kMapKinds) CheckMapsOfKind(workspace, image, kind, errors);
    CheckFilledMask(workspace, image, errors);
  }
  CheckCompactMaps(workspace, errors);
}

void WarnOfLeftovers(const Workspace& workspace, ProblemList* warnings) {
  for (const fs::path& file : FilesBelow(workspace.path(), HiddenFiles::kIncluded)) {
    if (!IsTemporaryFile(file)) continue;
    warnings->push_back((workspace.path() / file).string() +
                        ": left by a run that was killed; delete it when none is running");
  }
}

// Of the kinds that the last run made; of all where none is known.
bool HasMapsToMake(const Workspace& workspace, const std::vector<PatchMatchProblem>& problems) {
  ProblemList unreadable;  // told with the maps
  std::optional<RunRecord> record;
  Try(&unreadable, [&] { record.emplace(workspace.StereoFolder()); });
  if (!record) return true;
  std::set<std::string> kinds;
  for (const StageStatus& stage : FindStatus(*record).stages) kinds.insert(stage.name);
  for (const PatchMatchProblem& problem : problems) {
    for (const std::string_view view : kMapKinds) {
      const std::string kind(view);
      if (!kinds.empty() && !kinds.contains(kind)) continue;
      const auto task = record->Find(workspace.views()[problem.reference].name, kind);
      if (!HasMap(workspace, problem.reference, kind) || (task && task->state != "done")) return true;
    }
  }
  return false;
}

// Whether the maps still to be written can be, and fit on the disk.
void CheckDisk(const Workspace& workspace, const std::vector<PatchMatchProblem>& problems,
               WorkspaceReport* report) {
  const fs::path stereo = workspace.StereoFolder();
  Try(&report->errors, [&] { RequireReachable(stereo); });
  const fs::path folder = fs::exists(stereo) ? stereo : workspace.path();
  if (::access(folder.c_str(), W_OK | X_OK) != 0 && HasMapsToMake(workspace, problems)) {
    report->errors.push_back(folder.string() +
                             ": maps cannot be written into this folder; change its permissions");
  }
  std::uint64_t needed = 0;
  for (const PatchMatchProblem& problem : problems) {
    const phi::Pinhole& pinhole = workspace.views()[problem.reference].camera.pinhole;
    for (const std::string_view kind : kMapKinds) {
      if (HasMap(workspace, problem.reference, kind)) continue;
      needed += kMapBytesPerPixel * pinhole.width * pinhole.height;
    }
  }
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (!error && space.available < needed) {
    report->warnings.push_back(folder.string() + ": all maps need " + std::to_string(needed >> 20) +
                               " MiB, but only " + std::to_string(space.available >> 20) + " MiB are free");
  }
}

void CheckConfigs(const Workspace& workspace, const fs::path& config_path, WorkspaceReport* report) {
  std::vector<PatchMatchProblem> problems;
  Try(&report->errors, [&] { problems = ReadPatchMatchConfig(workspace, config_path, &report->errors); });
  Try(&report->errors, [&] { ReadFusionConfig(workspace, {}, &report->errors); });
  report->num_reference_images = problems.size();
  CheckDisk(workspace, problems, report);
}

}  // namespace

WorkspaceReport CheckWorkspace(const WorkspaceOptions& options, const fs::path& config_path,
                               const fs::path& fusion_mask_path) {
  WorkspaceReport report;
  std::optional<Workspace> workspace;
  Try(&report.errors, [&] { workspace.emplace(options, &report.errors); });
  if (!workspace) return report;  // without a model there is nothing to hold the rest against
  report.num_images = workspace->views().size();
  report.num_points = workspace->model().points.size();
  if (report.num_images == 1) {
    report.errors.push_back(options.path.string() +
                            ": one image is not enough for stereo; at least two are needed");
  }
  CheckPoints(*workspace, &report);
  if (const std::string warning = FramesWarning(options.path / "sparse", workspace->model()); !warning.empty()) {
    report.warnings.push_back(warning);
  }
  if (report.errors.empty()) CheckPoses(*workspace, &report);
  CheckImages(*workspace, &report.errors, &report.warnings);
  CheckMasks(*workspace, &report.errors, &report.warnings);
  CheckFusionMasks(*workspace, fusion_mask_path, &report.errors, &report.warnings);
  CheckConfigs(*workspace, config_path, &report);
  CheckMaps(*workspace, &report.errors);
  if (const phi::Message warning = MapScaleWarning(*workspace, {kGeometric, kMeasured, kPhotometric}); !warning.empty()) {
    report.warnings.push_back(warning);
  }
  WarnOfLeftovers(*workspace, &report.warnings);
  return report;
}

}  // namespace colmap_ext
