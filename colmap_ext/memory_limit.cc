#include "colmap_ext/memory_limit.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kVersion1Controller = "memory";

struct Hierarchy {
  fs::path folder;  // where its groups are mounted
  const char* limit_file;
};

bool HasMemoryController(const std::string& controllers) {
  std::istringstream list(controllers);
  for (std::string name; std::getline(list, name, ',');) {
    if (name == kVersion1Controller) return true;
  }
  return false;
}

class LimitFinder {
 public:
  // A file that is not there, and "max", which is no number, limit nothing.
  void Read(const fs::path& path) {
    std::int64_t limit = 0;
    if (std::ifstream(path) >> limit && limit > 0) least_ = std::min(least_.value_or(limit), limit);
  }

  // A group is bound by those that it is in. In a container the path may be the host's, which is not mounted there.
  void ReadUpToRoot(const Hierarchy& hierarchy, const fs::path& path) {
    fs::path group = path.relative_path().lexically_normal();
    if (!group.empty() && *group.begin() == "..") group.clear();
    for (; !group.empty(); group = group.parent_path()) Read(hierarchy.folder / group / hierarchy.limit_file);
    Read(hierarchy.folder / hierarchy.limit_file);
  }

  std::optional<std::int64_t> least() const { return least_; }

 private:
  std::optional<std::int64_t> least_;
};

}  // namespace

std::optional<std::int64_t> ControlGroupMemoryLimit(const fs::path& root) {
  const fs::path folder = root / "sys/fs/cgroup";
  const Hierarchy version1{folder / kVersion1Controller, "memory.limit_in_bytes"}, version2{folder, "memory.max"};
  LimitFinder limits;
  for (const Hierarchy& hierarchy : {version1, version2}) limits.ReadUpToRoot(hierarchy, "");
  std::ifstream file(root / "proc/self/cgroup");
  for (std::string number, controllers, path;
       std::getline(file, number, ':') && std::getline(file, controllers, ':') && std::getline(file, path);) {
    if (controllers.empty()) limits.ReadUpToRoot(version2, path);
    if (HasMemoryController(controllers)) limits.ReadUpToRoot(version1, path);
  }
  return limits.least();
}

std::int64_t AvailableHostBytes() {
  const std::int64_t num_bytes = static_cast<std::int64_t>(::sysconf(_SC_PHYS_PAGES)) * ::sysconf(_SC_PAGE_SIZE);
  return std::min(num_bytes, ControlGroupMemoryLimit().value_or(num_bytes));
}

}  // namespace colmap_ext
