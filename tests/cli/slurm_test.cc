// scripts/slurm/submit on a real Slurm, of one node on this machine: four shards, one of them killed and queued again, leave
// the bytes of a run without shards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "colmap_ext/pipeline/result_key.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using ::testing::HasSubstr;

const fs::path kRoot = PHIMVS_SOURCE_DIR;
constexpr int kCannotRunHere = 77;

class Slurm : public ::testing::Test {
 protected:
  void SetUp() override {
    const ProgramResult result = Cluster("start");
    if (result.exit_code == kCannotRunHere) GTEST_SKIP() << result.output;
    ASSERT_EQ(result.exit_code, 0) << result.output << result.errors;
  }
  void TearDown() override { Cluster("stop"); }

  ProgramResult Cluster(const std::string& action) const {
    return RunProgram(
        {(kRoot / "tests/support/loopback_slurm").string(), (folder_ / "slurm").string(), action});
  }
  ProgramResult Run(const std::vector<std::string>& command) const {
    return RunProgram(command,
                      {"SLURM_CONF=" + (folder_ / "slurm/slurm.conf").string(), "PHIMVS_WAIT_SECONDS=1"});
  }

  // The program, but the first time that shard 1 estimates it is killed when it has begun, and its job queued again.
  fs::path WriteKiller(const fs::path& workspace) const {
    const fs::path path = folder_ / "killer";
    test_support::WriteBytes(
        path,
        "#!/bin/bash\n"
        "if [[ \"$*\" == *'--shard 1/4 --stage photometric'* && -z \"${SLURM_RESTART_COUNT:-}\" ]]; then\n"
        "  '" PHIMVS_BINARY
        "' \"$@\" & pid=$!\n"
        "  until compgen -G '" +
            workspace.string() +
            "/stereo/phimvs.shards/1-of-4.*' >/dev/null; do sleep 0.01; done\n"
            "  kill -9 $pid; wait $pid; echo killed\n"
            "  scontrol requeue \"${SLURM_ARRAY_JOB_ID}_1\"; sleep 60\n"
            "fi\n"
            "exec '" PHIMVS_BINARY "' \"$@\"\n");
    fs::permissions(path, fs::perms::owner_all);
    return path;
  }

  bool WaitForJobs() const {
    for (int i = 0; i < 1200; ++i) {
      const ProgramResult queue = Run({"squeue", "--noheader"});
      if (queue.exit_code == 0 && queue.output.empty()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }

  TemporaryFolder folder_;
};

// "path: hash" of every file but those that hold times.
std::vector<std::string> HashFiles(const fs::path& folder) {
  std::vector<std::string> lines;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().extension() == ".json") continue;
    lines.push_back(fs::relative(entry.path(), folder).string() + ": " +
                    colmap_ext::ResultKey().Add(ReadBytes(entry.path())).Hex());
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

std::string AllLogs(const fs::path& folder) {
  std::string text;
  for (const auto& entry : fs::directory_iterator(folder))
    text += entry.path().string() + ":\n" + ReadBytes(entry.path());
  return text;
}

TEST_F(Slurm, FourShardsOneOfThemKilledLeaveTheBytesOfOneRun) {
  const fs::path sharded = folder_ / "sharded/dense", whole = folder_ / "whole/dense",
                 logs = folder_ / "logs of 100%j";
  ASSERT_EQ(RunProgram({PHIMVS_BINARY, "make_scene", "--output_path", (folder_ / "sharded").string(),
                        "--width", "96", "--height", "64", "--num_views", "8"})
                .exit_code,
            0);
  fs::copy(folder_ / "sharded", folder_ / "whole", fs::copy_options::recursive);
  const std::vector<std::string> cpu = {"--PhiStereo.backend", "cpu", "--PatchMatchStereo.num_iterations",
                                        "3"};
  std::vector<std::string> stereo = {PHIMVS_BINARY, "patch_match_stereo", "--workspace_path", whole.string()};
  stereo.insert(stereo.end(), cpu.begin(), cpu.end());
  ASSERT_EQ(Run(stereo).exit_code, 0);
  ASSERT_EQ(Run({PHIMVS_BINARY, "stereo_fusion", "--workspace_path", whole.string(), "--output_path",
                 (whole / "fused.ply").string()})
                .exit_code,
            0);

  std::vector<std::string> submit = {(kRoot / "scripts/slurm/submit").string(),
                                     sharded.string(),
                                     "--shards",
                                     "4",
                                     "--fusion-shards",
                                     "2",
                                     "--phimvs",
                                     WriteKiller(sharded).string(),
                                     "--logs",
                                     logs.string(),
                                     "--"};
  submit.insert(submit.end(), cpu.begin(), cpu.end());
  const ProgramResult submitted = Run(submit);
  ASSERT_EQ(submitted.exit_code, 0) << submitted.output << submitted.errors;
  for (const char* part : {"photometric: job ", "geometric: job ", "join: job ", "cloud: job ",
                           "killer status --workspace_path"})
    EXPECT_THAT(submitted.output, HasSubstr(part));
  ASSERT_TRUE(WaitForJobs()) << Run({"squeue"}).output << AllLogs(logs);
  EXPECT_THAT(AllLogs(logs), HasSubstr("killed\n"));
  EXPECT_EQ(HashFiles(sharded), HashFiles(whole)) << AllLogs(logs);
  EXPECT_THAT(Run({PHIMVS_BINARY, "status", "--workspace_path", sharded.string()}).output,
              HasSubstr("8 images"));
}

// With a stand-in for sbatch that says what it was given.
TEST(SlurmSubmit, PercentSignsOfFoldersAreNoPatterns) {
  const TemporaryFolder folder;
  for (const auto& [name, body] : {std::pair("sbatch", "echo \"$*\" >> '" + (folder / "calls").string() + "'; echo 7"),
                                   std::pair("phimvs", std::string("echo photometric"))}) {
    test_support::WriteBytes(folder / "bin" / name, "#!/bin/sh\n" + body + "\n");
    fs::permissions(folder / "bin" / name, fs::perms::owner_all);
  }
  const fs::path workspace = folder / "100%j";
  fs::create_directories(workspace);
  const ProgramResult result = RunProgram({(kRoot / "scripts/slurm/submit").string(), workspace.string(), "--shards", "2"},
                                          {"PATH=" + (folder / "bin").string() + ":/usr/bin:/bin"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const std::string calls = ReadBytes(folder / "calls");
  EXPECT_THAT(calls, HasSubstr("--output=" + (folder / "100%%j/slurm/photometric-%A_%a.log").string() + " "));
  EXPECT_THAT(calls, HasSubstr("--output=" + (folder / "100%%j/slurm/cloud-%j.log").string() + " "));
  EXPECT_THAT(calls, HasSubstr("--workspace_path " + workspace.string() + " "));
}

TEST(SlurmSubmit, HelpNamesWhatTheTasksReadOfTheEnvironment) {
  const std::string help = RunProgram({(kRoot / "scripts/slurm/submit").string(), "--help"}).output;
  for (const char* name : {"PHIMVS_WAIT_SECONDS", "PHIMVS_MOST_RESTARTS"}) {
    EXPECT_THAT(ReadBytes(kRoot / "scripts/slurm/task"), HasSubstr(name));
    EXPECT_THAT(help, HasSubstr(name));
  }
}

}  // namespace
