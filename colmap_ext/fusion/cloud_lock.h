// One phimvs at a time makes a cloud: the files of a cloud get their names one after the other, and those of two runs would mix.
#pragma once

#include <filesystem>

namespace colmap_ext {

// Held until destruction, and given up by the system when the process dies. Only processes that share the file system's locks see it.
class CloudLock {
 public:
  // output: the cloud's file or folder, which need not be there; makes the folder around it. Throws phi::InputError when another
  // process holds the lock.
  explicit CloudLock(const std::filesystem::path& output);
  ~CloudLock();
  CloudLock(const CloudLock&) = delete;
  CloudLock& operator=(const CloudLock&) = delete;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;  // -1: there are no locks here, or nothing can be written
};

}  // namespace colmap_ext
