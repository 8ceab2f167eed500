// Kills at random moments, disks that fill up at random sizes and two processes at once. Whatever happened, the command given
// again ends in the bytes of an undisturbed run, and nothing else is left. (make_scene is no such command: it refuses a folder
// that is there.) The same for shards, whose nodes may also have other clocks and see files late.
//
// Short here; scripts/chaos makes it long. PHIMVS_CHAOS_ROUNDS: rounds for each command; PHIMVS_CHAOS_SEED: of the random
// moments and sizes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <iterator>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "colmap_ext/pipeline/result_key.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/map_workspace.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watched_program.h"

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using test_support::ReadBytes;
using test_support::RunWatchedProgram;
using test_support::TemporaryFolder;
using test_support::WatchedResult;
using Lines = std::vector<std::string>;

int NumberFrom(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::atoi(text) : otherwise;
}

int NumRounds() { return NumberFrom("PHIMVS_CHAOS_ROUNDS", 1); }

// "path: hash" of every file but those that hold times.
Lines HashFiles(const fs::path& folder) {
  Lines lines;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    if (!entry.is_regular_file() || extension == ".json" || extension == ".html") continue;
    lines.push_back(fs::relative(entry.path(), folder).string() + ": " +
                    colmap_ext::ResultKey().Add(ReadBytes(entry.path())).Hex());
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

// The lines that only one of both has; sorted.
Lines Differences(const Lines& found, const Lines& expected) {
  Lines lines;
  std::set_symmetric_difference(found.begin(), found.end(), expected.begin(), expected.end(), std::back_inserter(lines));
  return lines;
}

constexpr int kRetryLater = 6;
constexpr int kNumNodes = 4;

// What a node has in its environment.
using Node = Lines;

// A command, and the folder that it starts from.
class Command {
 public:
  Command(std::string name, const fs::path& start, Lines options)
      : name_(std::move(name)), start_(start), options_(std::move(options)) {
    const TemporaryFolder folder;
    Prepare(folder.path());
    const auto begin = Clock::now();
    const WatchedResult result = Run(folder.path());
    EXPECT_EQ(result.exit_code, 0) << name_ << ": " << result.err;
    duration_ = Clock::now() - begin;
    expected_ = HashFiles(folder.path());
  }

  const std::string& name() const { return name_; }
  const Lines& expected() const { return expected_; }
  double seconds() const { return duration_.count(); }

  void Prepare(const fs::path& folder) const {
    if (!start_.empty())
      fs::copy(start_, folder, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  }
  // Options name the folder by @.
  Lines Arguments(const fs::path& folder) const {
    Lines arguments = {name_.substr(0, name_.find(' '))};
    for (const std::string& option : options_) {
      arguments.push_back(option.starts_with("@") ? (folder / option.substr(1)).string() : option);
    }
    return arguments;
  }
  WatchedResult Run(const fs::path& folder, const test_support::WatchOptions& options = {}) const {
    if (!nodes_.empty()) {
      const WatchedResult shards = RunShards(folder, options);
      if (shards.exit_code != 0) return shards;
    }
    return RunWatchedProgram(PHIMVS_BINARY, Arguments(folder), options);
  }

  // From now on in shards at once, one a node, and then whole. One that has to wait starts again after the pause.
  void UseNodes(std::vector<Node> nodes, std::chrono::milliseconds pause = std::chrono::milliseconds(100)) {
    name_ += " in shards";
    nodes_ = std::move(nodes);
    pause_ = pause;
  }
  // Until none has to wait.
  WatchedResult RunShards(const fs::path& folder, const test_support::WatchOptions& options = {}) const {
    std::vector<WatchedResult> results(nodes_.size());
    std::atomic<bool> any_failed = false;
    std::vector<std::thread> threads;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      threads.emplace_back([&, k] {
        Lines arguments = nodes_[k];
        arguments.emplace_back(PHIMVS_BINARY);
        for (const std::string& argument : Arguments(folder)) arguments.push_back(argument);
        arguments.insert(arguments.end(),
                         {"--shard", std::to_string(k) + "/" + std::to_string(nodes_.size())});
        for (int i = 0; i < kMaxStarts && !any_failed; ++i) {
          results[k] = RunWatchedProgram("/usr/bin/env", arguments, options);
          if (results[k].exit_code != kRetryLater) break;
          std::this_thread::sleep_for(pause_);
        }
        if (results[k].exit_code != 0) any_failed = true;
      });
    }
    for (std::thread& thread : threads) thread.join();
    // Those that were waiting for one that failed have not failed.
    const auto has_failed = [](const WatchedResult& r) {
      return r.exit_code != 0 && r.exit_code != kRetryLater;
    };
    const auto failed = std::find_if(results.begin(), results.end(), has_failed);
    if (failed != results.end()) return *failed;
    const auto waiting =
        std::find_if(results.begin(), results.end(), [](const WatchedResult& r) { return r.exit_code != 0; });
    return waiting != results.end() ? *waiting : results.front();
  }

 private:
  static constexpr int kMaxStarts = 50;

  std::string name_;
  fs::path start_;
  Lines options_, expected_;
  std::chrono::duration<double> duration_{0};
  std::vector<Node> nodes_;  // none: one process
  std::chrono::milliseconds pause_{0};
};

class Chaos : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folders_ = new TemporaryFolder();
    const fs::path fresh = *folders_ / "fresh", done = *folders_ / "done", foreign = *folders_ / "foreign",
                   exact = *folders_ / "exact";
    test_support::WriteNoiseWorkspace(fresh, {.num_images = 5, .width = 48, .height = 32});
    test_support::WriteMapWorkspace(
        test_support::PlaneScene({.width = 64, .height = 48, .focal = 60, .num_views = 4}), exact);
    const Lines stereo = {"--workspace_path", "@", "--PhiStereo.backend", "cpu"};
    commands_ = new std::vector<Command>();
    commands_->emplace_back("patch_match_stereo", fresh, stereo);
    // The maps of a finished workspace as another program's.
    fs::copy(fresh, foreign, fs::copy_options::recursive);
    EXPECT_EQ(commands_->front().Run(foreign).exit_code, 0);
    fs::copy(foreign, done, fs::copy_options::recursive);
    fs::remove(foreign / "stereo/phimvs.json");
    fs::remove_all(foreign / "stereo/filled_masks");
    Lines filling = stereo;
    filling.insert(filling.end(), {"--overwrite", "true"});
    commands_->emplace_back("hole_filler", foreign, filling);
    // Options that make all maps anew, over those of another run.
    Lines other_seed = stereo;
    other_seed.insert(other_seed.end(), {"--default_random_seed", "7"});
    commands_->emplace_back("patch_match_stereo", done, other_seed);
    commands_->emplace_back("stereo_fusion", exact,
                            Lines{"--workspace_path", "@", "--output_path", "@out/fused.ply"});
    commands_->emplace_back("stereo_fusion", exact,
                            Lines{"--workspace_path", "@", "--output_path", "@out", "--output_type", "BIN"});
    Lines dense = stereo;
    dense.insert(dense.end(), {"--output_path", "@out/cloud.ply", "--report_path", "@out/report.html",
                               "--StereoFusion.min_num_pixels", "2"});
    commands_->emplace_back("dense", fresh, dense);
    for (const char* keep : {"maps", "cloud"}) {
      Lines less = dense;
      less.insert(less.end(), {"--keep", keep});
      commands_->emplace_back("dense", fresh, less);
    }
    const fs::path room = *folders_ / "room/dense";
    EXPECT_EQ(RunWatchedProgram(PHIMVS_BINARY, {"make_scene", "--output_path", room.parent_path(), "--width",
                                                "96", "--height", "64", "--num_views", "8"})
                  .exit_code,
              0);
    Lines quick = stereo;
    quick.insert(quick.end(), {"--PatchMatchStereo.num_iterations", "3"});
    commands_->emplace_back("patch_match_stereo", room, quick);
    commands_->back().UseNodes(std::vector<Node>(kNumNodes));
  }
  static void TearDownTestSuite() {
    delete commands_;
    delete folders_;
  }

  std::mt19937 random_{static_cast<unsigned>(NumberFrom("PHIMVS_CHAOS_SEED", 1))};
  static TemporaryFolder* folders_;
  static std::vector<Command>* commands_;
};

TemporaryFolder* Chaos::folders_ = nullptr;
std::vector<Command>* Chaos::commands_ = nullptr;

// Kills once or twice, each time at a moment between the start and a little after the end of an undisturbed run.
TEST_F(Chaos, KilledCommandsEndInTheBytesOfACleanRun) {
  int num_killed = 0;
  for (const Command& command : *commands_) {
    for (int round = 0; round < NumRounds(); ++round) {
      const TemporaryFolder folder;
      command.Prepare(folder.path());
      const int num_kills = 1 + static_cast<int>(random_() % 2);
      for (int k = 0; k < num_kills; ++k) {
        const double moment = std::uniform_real_distribution<double>(0, 1.1 * command.seconds())(random_);
        const auto begin = Clock::now();
        const WatchedResult result =
            command.Run(folder.path(), {.while_running = [&](pid_t pid) {
                          if (std::chrono::duration<double>(Clock::now() - begin).count() >= moment)
                            kill(pid, SIGKILL);
                        }});
        num_killed += result.exit_code == 128 + SIGKILL;
      }
      const WatchedResult last = command.Run(folder.path());
      EXPECT_EQ(last.exit_code, 0) << command.name() << ": " << last.err;
      EXPECT_EQ(Differences(HashFiles(folder.path()), command.expected()), Lines()) << command.name() << ", round " << round;
    }
  }
  std::cout << num_killed << " runs were killed\n";
}

enum class DiskResult { kAsExpected = 10, kNotPermitted, kWrongCode, kOtherBytes };

// In a process of its own, whose mounts nobody else sees: a disk that is too small by a random amount, then grown bit by bit.
DiskResult RunOnFullDisks(const Command& command, const fs::path& disk, std::mt19937& random) {
  if (::unshare(CLONE_NEWNS) != 0) return DiskResult::kNotPermitted;
  ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
  if (::mount("none", disk.c_str(), "tmpfs", 0, "size=64m") != 0) return DiskResult::kNotPermitted;
  command.Prepare(disk);
  const fs::space_info space = fs::space(disk);
  std::uintmax_t kilobytes = (space.capacity - space.free) / 1024 + 4;
  for (int i = 0; i < 100; ++i) {
    const std::string size = "size=" + std::to_string(kilobytes) + "k";
    ::mount("none", disk.c_str(), "tmpfs", MS_REMOUNT, size.c_str());
    const WatchedResult result = command.Run(disk);
    if (result.exit_code == 0) {
      const Lines found = HashFiles(disk);
      if (found == command.expected()) return DiskResult::kAsExpected;
      Lines differing;
      std::set_symmetric_difference(found.begin(), found.end(), command.expected().begin(),
                                    command.expected().end(), std::back_inserter(differing));
      for (const std::string& line : differing) std::cerr << command.name() << ": " << line << "\n";
      return DiskResult::kOtherBytes;
    }
    if (result.exit_code != 3) {
      std::cerr << command.name() << " at " << size << ": exit code " << result.exit_code << "\n"
                << result.err;
      return DiskResult::kWrongCode;
    }
    kilobytes += 4 * (4 + random() % 60);
  }
  return DiskResult::kWrongCode;
}

TEST_F(Chaos, FullDisksLoseNothing) {
  for (const Command& command : *commands_) {
    for (int round = 0; round < (NumRounds() + 1) / 2; ++round) {
      const TemporaryFolder disk;
      const unsigned seed = random_();
      const pid_t child = ::fork();
      if (child == 0) {
        std::mt19937 random(seed);
        ::_exit(static_cast<int>(RunOnFullDisks(command, disk.path(), random)));
      }
      int status = 0;
      ::waitpid(child, &status, 0);
      const auto result = static_cast<DiskResult>(WEXITSTATUS(status));
      if (result == DiskResult::kNotPermitted)
        GTEST_SKIP() << "mounting a small file system needs privileges";
      EXPECT_EQ(result, DiskResult::kAsExpected) << command.name();
    }
  }
}

TEST_F(Chaos, TwoProcessesAtOnceEndInTheBytesOfOne) {
  for (const Command& command : *commands_) {
    for (int round = 0; round < (NumRounds() + 1) / 2; ++round) {
      const TemporaryFolder folder;
      command.Prepare(folder.path());
      std::thread other([&] { command.Run(folder.path()); });
      command.Run(folder.path());
      other.join();
      const WatchedResult last = command.Run(folder.path());
      EXPECT_EQ(last.exit_code, 0) << command.name() << ": " << last.err;
      EXPECT_EQ(Differences(HashFiles(folder.path()), command.expected()), Lines()) << command.name();
    }
  }
}

// In shards on such nodes; then a process without shards that sees all.
void ExpectBytesOfOneRun(Command command, std::vector<Node> nodes, std::chrono::milliseconds pause) {
  command.UseNodes(std::move(nodes), pause);
  for (int round = 0; round < (NumRounds() + 1) / 2; ++round) {
    const TemporaryFolder folder;
    command.Prepare(folder.path());
    std::this_thread::sleep_for(pause);  // until the start is an old file
    const WatchedResult shards = command.RunShards(folder.path());
    EXPECT_EQ(shards.exit_code, 0) << shards.err;
    std::this_thread::sleep_for(pause);
    EXPECT_EQ(command.Run(folder.path()).exit_code, 0);
    EXPECT_EQ(Differences(HashFiles(folder.path()), command.expected()), Lines()) << "round " << round;
  }
}

bool CanPreload() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return false;  // the sanitizer's library must come first
#else
  return true;
#endif
}

// One shard even takes the files' times for an hour later.
TEST_F(Chaos, NodesWithOtherClocksLeaveTheBytesOfOneRun) {
  const std::string library = "LD_PRELOAD=/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1";
  if (!CanPreload() || !fs::exists(library.substr(library.find('=') + 1)))
    GTEST_SKIP() << "needs libfaketime, and no sanitizer";
  ExpectBytesOfOneRun(commands_->back(),
                      {{},
                       {library, "FAKETIME=-1h", "NO_FAKE_STAT=1"},
                       {library, "FAKETIME=+1h", "NO_FAKE_STAT=1"},
                       {library, "FAKETIME=+1h"}},
                      std::chrono::milliseconds(100));
}

TEST_F(Chaos, NodesThatSeeFilesLateLeaveTheBytesOfOneRun) {
  if (!CanPreload()) GTEST_SKIP() << "needs a build without sanitizer";
  const auto node = [](const std::string& record_seconds) -> Node {
    return {"LD_PRELOAD=" PHIMVS_LATE_FILES, "PHIMVS_LATE_SECONDS=1",
            "PHIMVS_LATE_RECORD_SECONDS=" + record_seconds};
  };
  // Half of them see what was made before they see it.
  ExpectBytesOfOneRun(commands_->back(), {node("1"), node("0"), node("1"), node("0")},
                      std::chrono::milliseconds(1300));
}

}  // namespace
