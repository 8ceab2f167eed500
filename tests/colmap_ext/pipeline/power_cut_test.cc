// What a power cut must find: whatever gets a final name is on the disk before. The system calls that matter are watched.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <filesystem>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "colmap_ext/atomic_file.h"
#include "tests/support/fake_backend.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/run_pipeline.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

std::mutex g_mutex;  // guards what follows
bool g_watching = false;
std::set<fs::path> g_synced;           // by fsync
timespec g_last_sync = {};             // of the whole file system
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
  if (result == 0) g_last_sync = begin;
  return result;
}

extern "C" int rename(const char* from, const char* to) noexcept {
  const std::lock_guard<std::mutex> lock(g_mutex);
  struct stat status = {};
  if (g_watching && colmap_ext::IsTemporaryFile(from) && ::stat(from, &status) == 0) {
    ++g_num_renamed;
    if (g_synced.count(from) == 0 && IsBefore(g_last_sync, status.st_mtim)) g_too_early.emplace_back(to);
  }
  return Next<int(const char*, const char*)>("rename")(from, to);
}

namespace colmap_ext {
namespace {

TEST(PowerCut, WhatGetsAFinalNameIsOnTheDisk) {
  const test_support::TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 4});
  test_support::FakeCalls calls;
  const PipelineOptions options;
  Backends backends;
  backends.push_back(std::make_unique<test_support::FakeBackend>(&calls, 2));
  g_watching = true;
  test_support::RunPipeline({.path = folder.path()}, options, backends);
  g_watching = false;
  // Three kinds of maps of each image, each with normals.
  EXPECT_GE(g_num_renamed, 4 * 3 * 2);
  EXPECT_THAT(g_too_early, testing::IsEmpty());
}

}  // namespace
}  // namespace colmap_ext
