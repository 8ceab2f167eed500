// The program where something around it is wrong: streams that are closed or full, files that are none, limits.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/pipeline/workspace_lock.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/map_workspace.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watched_program.h"

namespace {

namespace fs = std::filesystem;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using test_support::WriteBytes;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

constexpr int kOutOfResources = 3;

// `prologue`: what a shell does before it becomes the program. `redirections`: of the program.
ProgramResult RunInShell(const std::string& prologue, std::vector<std::string> arguments,
                         const std::string& redirections = "") {
  std::vector<std::string> command = {
      "timeout", "60", "sh", "-c", prologue + " exec \"$0\" \"$@\" " + redirections, PHIMVS_BINARY};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return RunProgram(command);
}

constexpr char kCloud[] =
    "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
    "end_header\n0 0 0\n1 0 0\n";

class HostileFusion : public ::testing::Test {
 protected:
  void SetUp() override {
    test_support::WriteMapWorkspace(test_support::PlaneScene({.width = 64, .height = 48, .focal = 60}),
                                    folder_.path());
  }
  std::vector<std::string> Arguments(const fs::path& output) const {
    return {"stereo_fusion", "--workspace_path", folder_.path().string(), "--output_path", output.string()};
  }
  std::string CleanCloud() const {
    const fs::path path = folder_ / "clean/fused.ply";
    EXPECT_EQ(RunInShell("", Arguments(path)).exit_code, 0);
    return ReadBytes(path);
  }

  TemporaryFolder folder_;
};

// The first file that is opened would get the closed stream's number, and the log would go into it. A damaged mask makes the
// program log while it writes.
TEST_F(HostileFusion, ClosedStandardStreamsChangeNoByte) {
  constexpr int kSomeImagesFailed = 4;
  WriteBytes(folder_ / "stereo/filled_masks" / (test_support::MapWorkspaceImageName(1) + ".png"), "");
  EXPECT_EQ(RunInShell("", Arguments(folder_ / "clean/fused.ply")).exit_code, kSomeImagesFailed);
  const std::string expected = ReadBytes(folder_ / "clean/fused.ply");
  ASSERT_TRUE(expected.starts_with("ply\n"));
  for (const std::string closed : {"2>&-", "1>&- 2>&-", "0<&- 1>&- 2>&-"}) {
    const fs::path path = folder_ / "out/fused.ply";
    EXPECT_EQ(RunInShell("", Arguments(path), closed).exit_code, kSomeImagesFailed) << closed;
    EXPECT_TRUE(ReadBytes(path) == expected) << closed;
    fs::remove_all(path.parent_path());
  }
}

TEST_F(HostileFusion, LinksStayAndSpecialFilesAreRefused) {
  const std::string expected = CleanCloud();
  fs::create_directory(folder_ / "elsewhere");
  fs::create_symlink("elsewhere/target.ply", folder_ / "link.ply");
  for (int run = 0; run < 2; ++run) {  // to a file that is not there yet, and to one that is
    EXPECT_EQ(RunInShell("", Arguments(folder_ / "link.ply")).exit_code, 0);
    EXPECT_TRUE(fs::is_symlink(folder_ / "link.ply"));
    EXPECT_EQ(ReadBytes(folder_ / "elsewhere/target.ply"), expected);
  }
  ASSERT_EQ(::mkfifo((folder_ / "pipe.ply").c_str(), 0600), 0);
  fs::create_symlink(folder_ / "pipe.ply", folder_ / "link to pipe.ply");
  for (const char* name : {"pipe.ply", "link to pipe.ply"}) {
    const ProgramResult result = RunInShell("", Arguments(folder_ / name));
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_THAT(result.errors, AllOf(HasSubstr(name), HasSubstr("a device or a pipe")));
    EXPECT_TRUE(fs::is_fifo(folder_ / "pipe.ply")) << name;
  }
  if (::mknod((folder_ / "null.ply").c_str(), S_IFCHR | 0600, makedev(1, 3)) != 0) return;  // takes root
  EXPECT_EQ(RunInShell("", Arguments(folder_ / "null.ply")).exit_code, 2);
  EXPECT_TRUE(fs::is_character_file(folder_ / "null.ply"));
}

// A limit of 16 blocks of 512 or 1024 bytes, as the shell counts.
TEST_F(HostileFusion, AFileSizeLimitIsAnErrorWithAMessage) {
  const ProgramResult result = RunInShell("ulimit -f 16;", Arguments(folder_ / "out/fused.ply"));
  EXPECT_EQ(result.exit_code, kOutOfResources);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("fused.ply"), HasSubstr("free some space")));
  EXPECT_TRUE(fs::is_empty(folder_ / "out"));
}

TEST_F(HostileFusion, RemovesWhatAKilledOneLeftAndNothingThatIsBeingWritten) {
  const fs::path left = folder_ / "out/.phimvs-1-0.tmp", busy = folder_ / "out/.phimvs-1-1.tmp";
  WriteBytes(left, "half a cloud");
  WriteBytes(busy, "another process at work");
  const int file = ::open(busy.c_str(), O_WRONLY | O_CLOEXEC);
  ASSERT_EQ(::flock(file, LOCK_EX | LOCK_NB), 0);
  EXPECT_EQ(RunInShell("", Arguments(folder_ / "out/fused.ply")).exit_code, 0);
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(busy));
  ::close(file);
}

bool HasTemporaryFile(const fs::path& folder) {
  std::error_code missing;
  for (fs::directory_iterator it(folder, missing), end; !missing && it != end; it.increment(missing)) {
    if (it->path().filename().string().starts_with(".phimvs-")) return true;
  }
  return false;
}

// Their files would mix: the cloud of one, the views of the other.
TEST_F(HostileFusion, TwoWithOtherOptionsDoNotMakeOneCloud) {
  const std::string expected = CleanCloud(), expected_views = ReadBytes(folder_ / "clean/fused.ply.vis");
  const fs::path path = folder_ / "out/fused.ply";
  std::vector<std::string> others_arguments = Arguments(folder_ / "out/../out/fused.ply");
  others_arguments.insert(others_arguments.end(), {"--StereoFusion.min_num_pixels", "1"});
  ProgramResult other;
  // The first is held while it works. It may be done before it is caught, and it may be caught before it has the lock: then the other
  // one's cloud is whole, and the first one's takes its place.
  for (int run = 0; run < 50 && other.exit_code != 2; ++run) {
    const auto hold = [&](pid_t pid) {
      if (other.exit_code == 2 || !HasTemporaryFile(path.parent_path())) return;
      ::kill(pid, SIGSTOP);
      siginfo_t state;  // a signal takes its time, and meanwhile the program ends
      ::waitid(P_PID, static_cast<id_t>(pid), &state, WSTOPPED | WEXITED | WNOWAIT);
      if (HasTemporaryFile(path.parent_path())) other = RunInShell("", others_arguments);
      ::kill(pid, SIGCONT);
    };
    EXPECT_EQ(test_support::RunWatchedProgram(PHIMVS_BINARY, Arguments(path), {.while_running = hold}).exit_code, 0);
  }
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.errors, AllOf(HasSubstr("fused.ply"), HasSubstr("another phimvs is making this cloud; wait for it")));
  EXPECT_EQ(ReadBytes(path), expected);
  EXPECT_EQ(ReadBytes(path.string() + ".vis"), expected_views);
  EXPECT_FALSE(HasTemporaryFile(path.parent_path()));
  EXPECT_EQ(RunInShell("", others_arguments).exit_code, 0) << "the lock was kept";
}

TEST_F(HostileFusion, TwoWithOtherOptionsDoNotWriteOneSetOfConfidenceMaps) {
  std::vector<std::string> arguments = Arguments(folder_ / "out/fused.ply");
  arguments.insert(arguments.end(), {"--PhiFusion.write_confidence_maps", "true"});
  {
    const colmap_ext::WorkspaceLock other(folder_ / "stereo/confidence_maps");
    const ProgramResult result = RunInShell("", arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.errors, AllOf(HasSubstr("confidence_maps"), HasSubstr("another phimvs is at work")));
    EXPECT_EQ(RunInShell("", Arguments(folder_ / "out/fused.ply")).exit_code, 0);
  }
  EXPECT_EQ(RunInShell("", arguments).exit_code, 0);
}

TEST_F(HostileFusion, ABadMaskIsMadeAgainByTheStereoThatMadeIt) {
  // Fusion says so; that the stereo does it is tested with the pipeline.
  const std::string name = test_support::MapWorkspaceImageName(1), mask = folder_ / "stereo/filled_masks" / (name + ".png");
  WriteBytes(mask, "");
  const ProgramResult result = RunInShell("", Arguments(folder_ / "out/fused.ply"));
  EXPECT_EQ(result.exit_code, 4) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr(" images were left out, and the cloud is made of the others:\n  " + name + " (fusion): " + mask));
}

// Not after hours of stereo.
TEST(HostileOutput, DenseRefusesAPipeBeforeItWorks) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder / "dense", {.num_images = 3});
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const char* option : {"--output_path", "--report_path"}) {
    const ProgramResult result = RunInShell("", {"dense", "--workspace_path", folder / "dense",
                                                 "--PhiStereo.backend", "cpu", option, folder / "pipe"});
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_THAT(result.errors, HasSubstr("a device or a pipe")) << option;
    EXPECT_FALSE(fs::exists(folder / "dense/stereo/depth_maps")) << option;
  }
}

TEST(HostileOutput, AFullStandardOutputIsAnError) {
  const TemporaryFolder folder;
  test_support::WriteSmallWorkspace(folder.path());
  WriteBytes(folder / "cloud.ply", kCloud);
  const std::vector<std::vector<std::string>> commands = {
      {"evaluate", "--cloud_path", folder / "cloud.ply", "--truth_path", folder / "cloud.ply"},
      {"workspace_checker", "--workspace_path", folder.path()},
      {"help"},
      {"version"},
      {"help", "stereo_fusion"}};
  for (const auto& command : commands) {
    EXPECT_EQ(RunInShell("", command).exit_code, 0) << command[0];
    for (const std::string full : {">/dev/full", ">&-"}) {
      const ProgramResult result = RunInShell("", command, full);
      EXPECT_EQ(result.exit_code, kOutOfResources) << command[0] << full;
      EXPECT_THAT(result.errors, HasSubstr("standard output")) << command[0];
    }
  }
}

std::vector<std::string> StereoArguments(const fs::path& workspace) {
  return {"patch_match_stereo", "--workspace_path", workspace.string(), "--PhiStereo.backend", "cpu"};
}

TEST(HostileInput, APipeIsNoImageAndNoList) {
  const TemporaryFolder folder;
  const auto names = test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 4});
  const fs::path image = folder / "images" / names[1];
  fs::remove(image);
  ASSERT_EQ(::mkfifo(image.c_str(), 0600), 0);
  ASSERT_EQ(::mkfifo((folder / "list.cfg").c_str(), 0600), 0);
  const ProgramResult stereo = RunInShell("", StereoArguments(folder.path()));
  EXPECT_EQ(stereo.exit_code, 4) << stereo.errors;
  EXPECT_THAT(stereo.errors, HasSubstr(image.string()));
  auto with_list = StereoArguments(folder.path());
  with_list.insert(with_list.end(), {"--config_path", folder / "list.cfg"});
  const ProgramResult list = RunInShell("", with_list);
  EXPECT_EQ(list.exit_code, 2);
  EXPECT_THAT(list.errors, HasSubstr("list.cfg"));
}

TEST_F(HostileFusion, EvaluationAndReportWaitForNoPipe) {
  const std::string cloud = folder_ / "clean/fused.ply", pipe = folder_ / "pipe";
  CleanCloud();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const char* option : {"--crop_volume_path", "--cloud_transform_path"}) {
    const ProgramResult result =
        RunInShell("", {"evaluate", "--cloud_path", cloud, "--truth_path", cloud, option, pipe});
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_THAT(result.errors, HasSubstr(pipe + ": cannot be read: it is a folder, a pipe or a device")) << option;
  }
  fs::rename(pipe, cloud + ".vis");  // the report goes without the points' views
  EXPECT_EQ(RunInShell("", {"report", "--workspace_path", folder_.path(), "--cloud_path", cloud,
                            "--output_path", folder_ / "report.html"})
                .exit_code,
            0);
}

TEST(HostileInput, AnImageOfSixtyGigabytesFailsAlone) {
  const TemporaryFolder folder;
  const auto names = test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 4});
  const fs::path image = folder / "images" / names[1];
  std::error_code error;
  fs::resize_file(image, std::uintmax_t{60} << 30, error);
  if (error) GTEST_SKIP() << "this file system has no files with holes: " << error.message();
  const ProgramResult result = RunInShell("", StereoArguments(folder.path()));
  EXPECT_EQ(result.exit_code, 4) << result.errors;
  EXPECT_THAT(result.errors, AllOf(HasSubstr(image.string()), HasSubstr("more than any image")));
  EXPECT_TRUE(fs::exists(folder / "stereo/depth_maps" / (names[0] + ".geometric.bin")));
}

// As another user where root would ignore the limit; in bash, whose ulimit knows it.
TEST(HostileLimits, ThreadsThatCannotStartAreAnErrorWithAMessage) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 3});
  RunProgram({"chmod", "-R", "a+rwX", folder.path()});
  std::vector<std::string> command = {"timeout", "60"};
  if (::geteuid() == 0) {
    command.insert(command.end(), {"setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"});
  }
  command.insert(command.end(), {"bash", "-c", "ulimit -u 1; exec \"$0\" \"$@\"", PHIMVS_BINARY});
  const auto stereo = StereoArguments(folder.path());
  command.insert(command.end(), stereo.begin(), stereo.end());
  const ProgramResult result = RunProgram(command);
  if (result.exit_code == 126 || result.exit_code == 127)
    GTEST_SKIP() << "another user cannot run the program";
  EXPECT_EQ(result.exit_code, kOutOfResources) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("ulimit"));
}

// So few that no image can be opened beside what the program itself holds.
TEST(HostileLimits, TooManyOpenFilesAreNoImagesFault) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 3});
  for (int limit = 4; limit <= 8; ++limit) {
    const ProgramResult result =
        RunInShell("ulimit -n " + std::to_string(limit) + ";", StereoArguments(folder.path()));
    if (result.errors.find("error while loading shared libraries") != std::string::npos) continue;
    EXPECT_THAT(result.exit_code, AnyOf(0, kOutOfResources)) << limit << ": " << result.errors;
  }
}

TEST(HostileRecord, ReportAndFusionGoOnWithoutARecordThatIsNone) {
  for (const std::string& record : {std::string("no json"), std::string(), std::string(100000, '[')}) {
    const TemporaryFolder folder;
    const auto names = test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 3});
    ASSERT_EQ(RunInShell("", StereoArguments(folder.path())).exit_code, 0);
    WriteBytes(folder / "stereo/phimvs.json", record);
    const ProgramResult report = RunInShell(
        "", {"report", "--workspace_path", folder.path(), "--output_path", folder / "report.html"});
    EXPECT_EQ(report.exit_code, 0) << report.errors;
    EXPECT_THAT(ReadBytes(folder / "report.html"), HasSubstr("phimvs.json is damaged"));
    const ProgramResult fusion = RunInShell("", {"stereo_fusion", "--workspace_path", folder.path(),
                                                 "--output_path", folder / "fused.ply"});
    EXPECT_EQ(fusion.exit_code, 0) << fusion.errors;
    EXPECT_THAT(fusion.errors, AllOf(HasSubstr("is not known"), HasSubstr("phimvs.json is damaged")));
    const ProgramResult stereo = RunInShell("", StereoArguments(folder.path()));
    EXPECT_EQ(stereo.exit_code, 2);
    EXPECT_THAT(stereo.errors, HasSubstr("phimvs.json is damaged"));
  }
}

}  // namespace
