#include "colmap_ext/pipeline/map_removal.h"

#include <filesystem>
#include <string>
#include <system_error>

#include "colmap_ext/pipeline/file_identity.h"
#include "colmap_ext/pipeline/result_files.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/workspace_lock.h"

namespace colmap_ext {

namespace fs = std::filesystem;

void RemoveRecordedMaps(const Workspace& workspace) {
  const WorkspaceLock lock(workspace.StereoFolder());
  RunRecord record(workspace.StereoFolder());
  ConfidenceRemoval confidence(workspace);
  for (const auto& [task, result] : record.Tasks()) {
    const auto& [name, kind] = task;
    const int image = workspace.FindImage(name);
    if (image < 0) continue;
    confidence.Remove(kind);
    for (const fs::path& path : ResultPaths(workspace, image, kind)) {
      std::error_code ignored;  // what cannot be removed is not worth an error after hours of work
      if (IsOneOf(path, result.files)) fs::remove(path, ignored);
    }
    record.Forget(task);
  }
  record.Compact();
}

}  // namespace colmap_ext
