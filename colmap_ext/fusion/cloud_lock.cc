#include "colmap_ext/fusion/cloud_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

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

// Its holder removes it before it gives the lock up.
bool IsStillThere(int descriptor, const fs::path& path) {
  struct stat held = {}, found = {};
  return ::fstat(descriptor, &held) == 0 && ::stat(path.c_str(), &found) == 0 && held.st_dev == found.st_dev &&
         held.st_ino == found.st_ino;
}

}  // namespace

CloudLock::CloudLock(const fs::path& output) : path_(LockFile(output)) {
  constexpr int kTries = 5;  // who removes left-overs holds the lock for a moment
  constexpr auto kPause = std::chrono::milliseconds(20);
  std::error_code ignored;  // the cloud's own files tell what is wrong
  fs::create_directories(path_.parent_path(), ignored);
  bool is_refused = false;
  for (int i = 0; i < kTries; ++i) {
    if (is_refused) std::this_thread::sleep_for(kPause);
    descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (descriptor_ < 0) return;
    is_refused = ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (!is_refused && IsStillThere(descriptor_, path_)) return;
    ::close(std::exchange(descriptor_, -1));
  }
  if (!is_refused) return;
  throw phi::InputError(phi::AboutFile(output) +
                        ": another phimvs is making this cloud; wait for it or stop it, or give another --output_path");
}

// Closing alone would leave the lock with processes that were forked meanwhile.
CloudLock::~CloudLock() {
  if (descriptor_ < 0) return;
  ::unlink(path_.c_str());
  ::flock(descriptor_, LOCK_UN);
  ::close(descriptor_);
}

}  // namespace colmap_ext
