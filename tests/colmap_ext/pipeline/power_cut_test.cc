// What a power cut must find: whatever gets a final name is on the disk before. The system calls that matter are watched.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/pipeline/run_record.h"
#include "tests/support/fake_backend.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/run_pipeline.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

std::mutex g_mutex;  // guards what follows
bool g_watching = false;
std::multiset<fs::path> g_synced;        // by fsync
std::map<dev_t, timespec> g_last_syncs;  // of whole file systems
std::vector<std::string> g_too_early;  // final names of files that were not on the disk
int g_num_renamed = 0;

bool IsBefore(const timespec& a, const timespec& b) {
  return a.tv_sec != b.tv_sec ? a.tv_sec < b.tv_sec : a.tv_nsec < b.tv_nsec;
}

template <typename Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" int fsync(int descriptor) {
  const int result = Next<int(int)>("fsync")(descriptor);
  const std::lock_guard<std::mutex> lock(g_mutex);
  std::error_code error;
  if (g_watching && result == 0)
    g_synced.insert(fs::read_symlink("/proc/self/fd/" + std::to_string(descriptor), error));
  return result;
}

extern "C" int syncfs(int descriptor) noexcept {
  timespec begin = {};
  ::clock_gettime(CLOCK_REALTIME, &begin);
  const int result = Next<int(int)>("syncfs")(descriptor);
  const std::lock_guard<std::mutex> lock(g_mutex);
  struct stat status = {};
  if (result == 0 && ::fstat(descriptor, &status) == 0) g_last_syncs[status.st_dev] = begin;
  return result;
}

extern "C" int rename(const char* from, const char* to) noexcept {
  const std::lock_guard<std::mutex> lock(g_mutex);
  struct stat status = {};
  if (g_watching && colmap_ext::IsTemporaryFile(from) && ::stat(from, &status) == 0) {
    ++g_num_renamed;
    if (g_synced.count(from) == 0 && IsBefore(g_last_syncs[status.st_dev], status.st_mtim)) g_too_early.emplace_back(to);
  }
  return Next<int(const char*, const char*)>("rename")(from, to);
}

namespace colmap_ext {
namespace {

// Counts what gets a name, and lists what was not on the disk.
void RunWatched(const fs::path& folder) {
  test_support::FakeCalls calls;
  const PipelineOptions options;
  Backends backends;
  backends.push_back(std::make_unique<test_support::FakeBackend>(&calls, 2));
  g_num_renamed = 0;
  g_too_early.clear();
  g_watching = true;
  test_support::RunPipeline({.path = folder}, options, backends);
  g_watching = false;
}

constexpr int kNumImages = 4;
constexpr int kNumFiles = kNumImages * 3 * 2;  // three kinds of maps of each image, each with normals

TEST(PowerCut, WhatGetsAFinalNameIsOnTheDisk) {
  const test_support::TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = kNumImages});
  RunWatched(folder.path());
  EXPECT_GE(g_num_renamed, kNumFiles);
  EXPECT_THAT(g_too_early, testing::IsEmpty());
}

struct RemovedFolder {
  ~RemovedFolder() { fs::remove_all(path); }
  const fs::path path;
};

// Maps lie where there is room, the journal with the workspace.
TEST(PowerCut, WhatGetsAFinalNameOnAnotherDiskIsOnThatDisk) {
  const test_support::TemporaryFolder folder;
  const RemovedFolder other{fs::path("/dev/shm") / folder.path().filename()};
  std::error_code error;
  struct stat here = {}, there = {};
  if (!fs::create_directories(other.path, error) || ::stat(folder.path().c_str(), &here) != 0 ||
      ::stat(other.path.c_str(), &there) != 0 || here.st_dev == there.st_dev) {
    GTEST_SKIP() << "/dev/shm is no other file system than " << folder.path();
  }
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = kNumImages});
  for (const char* name : {"depth_maps", "normal_maps"}) {
    fs::create_directory(other.path / name);
    fs::remove_all(folder / "stereo" / name);
    fs::create_directory_symlink(other.path / name, folder / "stereo" / name);
  }
  RunWatched(folder.path());
  EXPECT_GE(g_num_renamed, kNumFiles);
  EXPECT_THAT(g_too_early, testing::IsEmpty());
}

// A sync takes as long as several maps on a slow disk.
TEST(PowerCut, TheRecordsFolderIsSyncedOnce) {
  const test_support::TemporaryFolder folder;
  RunRecord record(folder.path());
  record.SetOptions({}, "hash");
  g_synced.clear();
  g_watching = true;
  record.Compact();
  g_watching = false;
  EXPECT_EQ(g_synced.count(fs::canonical(folder.path())), 1u);
}

}  // namespace
}  // namespace colmap_ext
