#include "colmap_ext/control_groups.h"

#include <fstream>
#include <sstream>
#include <string>

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

bool Names(const std::string& controllers, std::string_view controller) {
  std::istringstream list(controllers);
  for (std::string name; std::getline(list, name, ',');) {
    if (name == controller) return true;
  }
  return false;
}

}  // namespace

void ForControlGroups(const fs::path& root, std::string_view controller,
                      const std::function<void(const fs::path& folder, GroupVersion version)>& function) {
  const fs::path version2 = root / "sys/fs/cgroup", version1 = version2 / controller;
  // In a container the path may be the host's, which is not mounted there.
  const auto up_to_root = [&](const fs::path& mounted, const fs::path& path, GroupVersion version) {
    fs::path group = path.relative_path().lexically_normal();
    if (!group.empty() && *group.begin() == "..") group.clear();
    for (; !group.empty(); group = group.parent_path()) function(mounted / group, version);
    function(mounted, version);
  };
  up_to_root(version1, "", GroupVersion::kOne);
  up_to_root(version2, "", GroupVersion::kTwo);
  std::ifstream file(root / "proc/self/cgroup");
  for (std::string number, controllers, path;
       std::getline(file, number, ':') && std::getline(file, controllers, ':') && std::getline(file, path);) {
    if (controllers.empty()) up_to_root(version2, path, GroupVersion::kTwo);
    if (Names(controllers, controller)) up_to_root(version1, path, GroupVersion::kOne);
  }
}

}  // namespace colmap_ext
