#include "colmap_ext/dead_link.h"

#include <system_error>

#include "phi/base/error.h"

namespace colmap_ext {

namespace fs = std::filesystem;

std::string DescribeDeadLink(const fs::path& path) {
  std::error_code unreachable;
  for (fs::path link = path; !link.empty(); link = link.parent_path()) {
    if (fs::is_symlink(fs::symlink_status(link, unreachable)) && !fs::exists(link, unreachable)) {
      return "'" + link.filename().string() + "' is a link to " +
             fs::read_symlink(link, unreachable).string() +
             ", which cannot be reached; mount or restore that";
    }
    if (link == link.root_path()) break;
  }
  return "";
}

void RequireReachable(const fs::path& stereo_folder) {
  const auto require = [](const fs::path& path) {
    if (const std::string dead = DescribeDeadLink(path); !dead.empty())
      throw phi::InputError(phi::AboutFile(path) + ": " + dead);
  };
  require(stereo_folder);
  std::error_code unreachable;
  for (fs::directory_iterator entry(stereo_folder, unreachable), end; !unreachable && entry != end;
       entry.increment(unreachable)) {
    require(entry->path());
  }
}

}  // namespace colmap_ext
