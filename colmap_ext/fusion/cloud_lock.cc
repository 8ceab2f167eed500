#include "colmap_ext/fusion/cloud_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <string>
#include <system_error>
#include <utility>

#include "colmap_ext/file_locks.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// Beside the cloud, since files are replaced. The name is that of a temporary file: the next command in the folder removes what a
// killed process left (atomic_file.h).
fs::path LockFile(const fs::path& output) {
  constexpr std::size_t kMostOfName = 200;  // bytes; names that differ later share a lock
  std::error_code error;
  fs::path whole = fs::weakly_canonical(output, error);
  if (error) whole = output;
  whole = fs::absolute(whole, error).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // a folder's name may end in a slash
  return whole.parent_path() / (".phimvs-lock-" + whole.filename().string().substr(0, kMostOfName) + ".tmp");
}

}  // namespace

CloudLock::CloudLock(const fs::path& output) : path_(LockFile(output)) {
  std::error_code ignored;  // the cloud's own files tell what is wrong
  fs::create_directories(path_.parent_path(), ignored);
  for (;;) {
    descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (descriptor_ < 0) return;
    if (IsLockRefused(descriptor_, LOCK_EX)) break;
    if (!IsUnlinked(descriptor_)) return;  // its holder removes it before it gives the lock up
    ::close(std::exchange(descriptor_, -1));
  }
  ::close(std::exchange(descriptor_, -1));
  throw phi::InputError(phi::AboutFile(output) +
                        ": another phimvs is making this cloud; wait for it or stop it, or give another --output_path");
}

CloudLock::~CloudLock() {
  if (descriptor_ >= 0) ::unlink(path_.c_str());
  ReleaseLock(descriptor_);
}

}  // namespace colmap_ext
