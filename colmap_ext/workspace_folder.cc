#include "colmap_ext/workspace_folder.h"

#include <algorithm>
#include <string>
#include <vector>

#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// As image_undistorter writes it; the sparse/ of a project that was not undistorted holds folders of models.
bool IsWorkspace(const fs::path& path) {
  std::error_code unreadable;
  const fs::path sparse = path / "sparse";
  return fs::is_directory(path / "images", unreadable) &&
         (fs::exists(sparse / "cameras.bin", unreadable) || fs::exists(sparse / "cameras.txt", unreadable));
}

// Where image_undistorter and automatic_reconstructor put them, sorted.
std::vector<fs::path> WorkspacesBelow(const fs::path& path) {
  if (IsWorkspace(path / "dense")) return {path / "dense"};
  std::vector<fs::path> found;
  for (const fs::path& folder : {path / "dense", path}) {
    std::error_code unreadable;
    for (const auto& entry : fs::directory_iterator(folder, unreadable)) {
      if (IsWorkspace(entry.path())) found.push_back(entry.path());
    }
    if (!found.empty()) break;
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

fs::path FindWorkspaceFolder(const fs::path& path) {
  if (IsWorkspace(path)) return path;
  const std::vector<fs::path> found = WorkspacesBelow(path);
  if (found.empty()) return path;
  if (found.size() > 1) {
    throw phi::InputError("--workspace_path " + phi::AboutFile(path) + " holds " + std::to_string(found.size()) +
                          " workspaces, " + found[0].string() + " and " + found[1].string() +
                          " among them: name one of them");
  }
  phi::LogInfo("workspace: " + found[0].string());
  return found[0];
}

}  // namespace colmap_ext
