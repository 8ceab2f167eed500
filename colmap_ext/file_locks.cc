#include "colmap_ext/file_locks.h"

#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>

namespace colmap_ext {

bool IsLockRefused(int descriptor, int kind) {
  constexpr int kTries = 5;
  constexpr auto kPause = std::chrono::milliseconds(20);
  for (int i = 0; i < kTries; ++i) {
    if (i > 0) std::this_thread::sleep_for(kPause);
    if (::flock(descriptor, kind | LOCK_NB) == 0 || errno != EWOULDBLOCK) return false;
  }
  return true;
}

bool IsUnlinked(int descriptor) {
  struct stat status = {};
  return ::fstat(descriptor, &status) == 0 && status.st_nlink == 0;
}

void ReleaseLock(int descriptor) {
  if (descriptor < 0) return;
  ::flock(descriptor, LOCK_UN);
  ::close(descriptor);
}

}  // namespace colmap_ext
