#include "colmap_ext/pipeline/workspace_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/dead_link.h"
#include "colmap_ext/file_locks.h"
#include "colmap_ext/folder_files.h"
#include "phi/base/error.h"

namespace colmap_ext {

namespace fs = std::filesystem;

namespace {

int OpenFolder(const fs::path& folder) { return open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); }

}  // namespace

WorkspaceLock::WorkspaceLock(const fs::path& stereo_folder, Sharing sharing) {
  RequireReachable(stereo_folder);
  std::error_code error;
  fs::create_directories(stereo_folder, error);
  if (error)
    throw phi::InputError("cannot make the folder " + phi::AboutFile(stereo_folder) + ": " + error.message());
  descriptor_ = OpenFolder(stereo_folder);
  // Some network file systems have no locks: then the user is trusted.
  const int kind = sharing == Sharing::kAlone ? LOCK_EX : LOCK_SH;
  if (descriptor_ >= 0 && IsLockRefused(descriptor_, kind)) {
    close(descriptor_);
    throw phi::InputError(phi::AboutFile(stereo_folder) +
                          ": another phimvs is at work in this workspace; wait for it or stop it");
  }
}

WorkspaceLock::~WorkspaceLock() { ReleaseLock(descriptor_); }

LockUse FindLockUse(const fs::path& stereo_folder) {
  const int folder = OpenFolder(stereo_folder);
  if (folder < 0) return LockUse::kUnknown;
  const bool is_free = flock(folder, LOCK_EX | LOCK_NB) == 0;
  const bool is_held = !is_free && errno == EWOULDBLOCK;
  ReleaseLock(folder);
  return is_free ? LockUse::kFree : is_held ? LockUse::kHeld : LockUse::kUnknown;
}

void RemoveTemporaryFiles(const fs::path& stereo_folder) {
  for (const fs::path& file : FilesBelow(stereo_folder, HiddenFiles::kIncluded)) RemoveIfLeftOver(stereo_folder / file);
}

}  // namespace colmap_ext
