// A network file system that shows new files late, for a program started with LD_PRELOAD=this library: below a folder "stereo"
// or "*.parts", a file that has had its name for less than PHIMVS_LATE_SECONDS (a shard's journal: PHIMVS_LATE_RECORD_SECONDS)
// neither exists nor is listed. Temporary files are there at once, and so is what a program opens to write.
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace {

template <typename Function>
Function* Real(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

double Seconds(const statx_timestamp& time) { return static_cast<double>(time.tv_sec) + time.tv_nsec * 1e-9; }

// A journal is as old as its first line; another file has its name since its last change.
bool IsHidden(int folder, const char* path) {
  if (std::strstr(path, ".phimvs-") != nullptr) return false;
  const int error = errno;
  struct statx status = {};
  const bool is_file =
      ::statx(folder, path, 0, STATX_BASIC_STATS | STATX_BTIME, &status) == 0 && S_ISREG(status.stx_mode);
  errno = error;
  timespec now = {};
  ::clock_gettime(CLOCK_REALTIME, &now);
  const char* suffix = std::strrchr(path, '.');
  const bool is_journal = suffix != nullptr && std::strcmp(suffix, ".journal") == 0;
  const double late =
      std::atof(std::getenv(is_journal ? "PHIMVS_LATE_RECORD_SECONDS" : "PHIMVS_LATE_SECONDS"));
  return is_file && static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9 <
                        Seconds(is_journal ? status.stx_btime : status.stx_ctime) + late;
}

bool IsHiddenPath(const char* path) {
  return (std::strstr(path, "/stereo/") != nullptr || std::strstr(path, ".parts/") != nullptr) &&
         IsHidden(AT_FDCWD, path);
}

int Missing() {
  errno = ENOENT;
  return -1;
}

}  // namespace

extern "C" {

int stat(const char* path, struct stat* status) noexcept {
  return IsHiddenPath(path) ? Missing() : Real<int(const char*, struct stat*)>("stat")(path, status);
}

FILE* fopen64(const char* path, const char* mode) {
  if (mode[0] == 'r' && IsHiddenPath(path)) {
    Missing();
    return nullptr;
  }
  return Real<FILE*(const char*, const char*)>("fopen64")(path, mode);
}

FILE* fopen(const char* path, const char* mode) { return fopen64(path, mode); }

dirent* readdir(DIR* folder) {
  for (;;) {
    dirent* entry = Real<dirent*(DIR*)>("readdir")(folder);
    if (entry == nullptr || entry->d_type != DT_REG || !IsHidden(::dirfd(folder), entry->d_name))
      return entry;
  }
}

}  // extern "C"
