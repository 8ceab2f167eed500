// One phimvs at a time writes into a workspace, or the shards of one. Only processes of one computer see the lock.
#pragma once

#include <filesystem>

namespace colmap_ext {

// Held until destruction, and given up by the system when the process dies.
class WorkspaceLock {
 public:
  enum class Sharing { kAlone, kWithShards };

  // Creates the folder where it is missing. Throws phi::InputError when another process holds the lock, and for folders that cannot
  // be reached (dead_link.h).
  explicit WorkspaceLock(const std::filesystem::path& stereo_folder, Sharing sharing = Sharing::kAlone);
  ~WorkspaceLock();
  WorkspaceLock(const WorkspaceLock&) = delete;
  WorkspaceLock& operator=(const WorkspaceLock&) = delete;

 private:
  int descriptor_ = -1;
};

// Whether some process of this computer holds the lock. Takes it for a moment, for which WorkspaceLock waits.
enum class LockUse { kFree, kHeld, kUnknown };  // kUnknown: the file system has no locks
LockUse FindLockUse(const std::filesystem::path& stereo_folder);

// Removes what a killed process left half-written. Call with the lock held alone.
void RemoveTemporaryFiles(const std::filesystem::path& stereo_folder);

}  // namespace colmap_ext
