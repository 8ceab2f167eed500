#include "colmap_ext/pipeline/result_files.h"

#include <algorithm>
#include <system_error>

#include "colmap_ext/compact_map.h"
#include "colmap_ext/map_file.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/pipeline/file_identity.h"
#include "phi/base/error.h"
#include "phi/base/log.h"
#include "phi/base/whole_array.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// What a file system leaves that had written a file's size and not yet its data: no one's work is lost with it.
bool HoldsValues(const fs::path& path, int num_channels) {
  const auto any = [](const auto& map, const auto& has_value) {
    return std::any_of(map.data(), map.data() + map.size(), has_value);
  };
  if (num_channels == 1) return any(ReadDepthMap(path), [](float value) { return value != 0; });
  return any(ReadNormalMap(path), [](const phi::Vec3f& n) { return n.x != 0 || n.y != 0 || n.z != 0; });
}

bool HasDepth(const phi::PlaneHypothesis& h) { return h.depth > 0; }

// Whoever made it, of whatever size.
bool IsWholeFile(const fs::path& path) {
  try {
    if (path.extension() == ".map") return phi::CountIf(ReadCompactMap(path).planes, HasDepth) > 0;
    if (path.extension() != ".bin") return ReadMask(path).size() > 0;
    return HoldsValues(path, ReadMapSize(path).channels);
  } catch (const phi::InputError&) {
    return false;
  }
}

void RemoveConfidenceMaps(const Workspace& workspace, const std::string& kind) {
  std::error_code unreachable;
  if (!fs::exists(workspace.ConfidenceMapsFolder(), unreachable)) return;  // and ask for no file of ten thousand images
  int num_removed = 0;
  for (int image = 0; image < static_cast<int>(workspace.views().size()); ++image) {
    std::error_code ignored;  // what cannot be removed is not worth an error after hours of work
    num_removed += fs::remove(workspace.ConfidenceMapPath(image, kind), ignored);
  }
  if (num_removed > 0) {
    phi::LogInfo(phi::AboutFile(workspace.ConfidenceMapsFolder()) + ": " + std::to_string(num_removed) +
                 " confidence maps are removed, since " + kind + " maps that they rest on change; fusion writes them anew");
  }
}

}  // namespace

std::vector<fs::path> ResultPaths(const Workspace& workspace, int image, const std::string& kind) {
  return {workspace.DepthMapPath(image, kind), workspace.NormalMapPath(image, kind),
          workspace.FilledMaskPath(image, kind), workspace.CostMapPath(image, kind),
          CompactMapPath(workspace, image, kind)};
}

FileState StateOf(const fs::path& path, const TaskRecord* record) {
  std::error_code unreachable;
  if (!fs::exists(path, unreachable)) return FileState::kMissing;
  if (record == nullptr) return FileState::kForeign;
  const bool is_of_earlier_program =
      record->state == "done" && record->files.empty();  // which did not identify its files
  if (is_of_earlier_program) return IsWholeFile(path) ? FileState::kCurrent : FileState::kOurs;
  if (IsOneOf(path, record->files)) return FileState::kCurrent;
  return IsOneOf(path, record->earlier) || !IsWholeFile(path) ? FileState::kOurs : FileState::kForeign;
}

void ConfidenceRemoval::Remove(const std::string& kind) {
  const std::scoped_lock lock(mutex_);
  if (removed_.insert(kind).second) RemoveConfidenceMaps(workspace_, kind);
}

}  // namespace colmap_ext
