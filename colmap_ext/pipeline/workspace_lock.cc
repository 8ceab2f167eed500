#include "colmap_ext/pipeline/workspace_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "phi/base/error.h"

namespace colmap_ext {

namespace fs = std::filesystem;

WorkspaceLock::WorkspaceLock(const fs::path& stereo_folder, Sharing sharing) {
  std::error_code error;
  fs::create_directories(stereo_folder, error);
  if (error)
    throw phi::InputError("cannot make the folder " + phi::AboutFile(stereo_folder) + ": " + error.message());
  descriptor_ = open(stereo_folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  // Some network file systems have no locks: then the user is trusted.
  const int kind = sharing == Sharing::kAlone ? LOCK_EX : LOCK_SH;
  if (descriptor_ >= 0 && flock(descriptor_, kind | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(descriptor_);
    throw phi::InputError(phi::AboutFile(stereo_folder) +
                          ": another phimvs is at work in this workspace; wait for it or stop it");
  }
}

WorkspaceLock::~WorkspaceLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

void RemoveTemporaryFiles(const fs::path& stereo_folder) {
  std::vector<fs::path> leftovers;
  std::error_code error;
  for (fs::recursive_directory_iterator it(stereo_folder, error), end; it != end; it.increment(error)) {
    if (error) return;
    if (IsTemporaryFile(it->path())) leftovers.push_back(it->path());
  }
  for (const fs::path& path : leftovers) RemoveIfLeftOver(path);
}

}  // namespace colmap_ext
