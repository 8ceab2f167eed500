#include "colmap_ext/fusion/replaced_model.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>

#include "colmap_ext/sparse_model.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

bool HasObservedPoint(const SparseImage& image) {
  return std::any_of(image.observations.begin(), image.observations.end(),
                     [](const Observation& observation) { return observation.point3D_id != kInvalidPoint3D; });
}

bool IsIn(const SparseModel& model, const SparseCamera& camera) {
  const auto found = model.cameras.find(camera.camera_id);
  return found != model.cameras.end() && found->second.model_id == camera.model_id && found->second.width == camera.width &&
         found->second.height == camera.height && found->second.params == camera.params;
}

bool IsIn(const SparseModel& model, const SparseImage& image) {
  return std::any_of(model.images.begin(), model.images.end(), [&](const SparseImage& other) {
    return other.image_id == image.image_id && other.camera_id == image.camera_id && other.name == image.name &&
           other.rotation.coeffs() == image.rotation.coeffs() && other.translation == image.translation;
  });
}

// Fusion's points have neither tracks nor a known error, and no image observes them. A model without points is as good as a cloud where
// its cameras and images are the workspace's, and would be written again.
bool IsCloud(const SparseModel& head, const SparseModel& of_workspace) {
  if (std::any_of(head.images.begin(), head.images.end(), HasObservedPoint)) return false;
  if (!head.points.empty()) return head.points.front().track.empty() && head.points.front().error == -1;
  return std::all_of(head.cameras.begin(), head.cameras.end(), [&](const auto& entry) { return IsIn(of_workspace, entry.second); }) &&
         std::all_of(head.images.begin(), head.images.end(), [&](const SparseImage& image) { return IsIn(of_workspace, image); });
}

bool IsReplaceable(const fs::path& folder, const std::string& suffix, const SparseModel& of_workspace) {
  for (const char* stem : {"rigs", "frames"}) {
    if (fs::exists(folder / (stem + suffix))) return false;  // which no cloud has
  }
  try {
    return IsCloud(ReadModelHead(folder, suffix), of_workspace);
  } catch (const phi::InputError&) {
    return false;  // damaged, or of another form: not known to be ours
  }
}

}  // namespace

void RequireReplaceableModel(const Workspace& workspace, const CloudOutput& output) {
  if (output.IsFile()) return;
  const phi::Message place = "--output_path " + phi::AboutFile(output.path);
  std::error_code error;  // the folder need not be there
  if (fs::equivalent(output.path, workspace.path() / "sparse", error)) {
    throw phi::UsageError(place + " holds the workspace's own model, which the cloud would replace; give another folder");
  }
  if (IsReplaceable(output.path, output.type == CloudType::kBinary ? ".bin" : ".txt", workspace.model())) return;
  throw phi::UsageError(place +
                        " holds a sparse model that stereo_fusion did not write, and the cloud would replace it; give another folder");
}

}  // namespace colmap_ext
