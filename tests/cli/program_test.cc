// The program as a user meets it: help, exit codes, messages, signals, going on after a kill.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "colmap_ext/image_file.h"
#include "colmap_ext/pipeline/run_record.h"
#include "colmap_ext/pipeline/workspace_lock.h"
#include "tests/support/noise_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watched_program.h"

namespace {

using test_support::TemporaryFolder;
using test_support::WatchedResult;
using test_support::WatchOptions;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

WatchedResult RunPhimvs(const std::vector<std::string>& arguments, const WatchOptions& options = {}) {
  return test_support::RunWatchedProgram(PHIMVS_BINARY, arguments, options);
}

// Small enough for a unit test, several steps long.
std::vector<std::string> StereoArguments(const std::filesystem::path& workspace) {
  return {"patch_match_stereo", "--workspace_path", workspace.string(), "--PhiStereo.backend", "cpu"};
}

WatchedResult RunStereo(const std::filesystem::path& workspace, std::vector<std::string> more = {},
                        const WatchOptions& options = {}) {
  std::vector<std::string> arguments = StereoArguments(workspace);
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunPhimvs(arguments, options);
}

int CountMaps(const std::filesystem::path& workspace, const std::string& kind) {
  const auto folder = workspace / "stereo/depth_maps/a";
  int count = 0;
  if (!std::filesystem::exists(folder)) return 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    count += entry.path().filename().string().find("png." + kind + ".bin") != std::string::npos;
  }
  return count;
}

// Sends `signal` once as many maps of a kind are there as asked for.
WatchOptions SignalAt(const std::filesystem::path& workspace, const std::string& kind, int num_maps,
                      int signal) {
  return {.while_running = [workspace, kind, num_maps, signal, sent = false](pid_t pid) mutable {
    if (sent || CountMaps(workspace, kind) < num_maps) return;
    sent = true;
    kill(pid, signal);
  }};
}

TEST(ProgramTest, HelpAndVersionGoToStdout) {
  for (const char* argument : {"help", "-h", "--help"}) {
    const WatchedResult result = RunPhimvs({argument});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("patch_match_stereo"));
    EXPECT_EQ(result.err, "");
  }
  EXPECT_THAT(RunPhimvs({"version"}).out,
              ContainsRegex("^phimvs [0-9]+\\.[0-9]+\\.[0-9]+\ncommit ([0-9a-f]+|unknown)\nCUDA architectures: .*\n(.*\n)*"
                            "backend cpu "));
  EXPECT_EQ(RunPhimvs({"--version"}).out, RunPhimvs({"version"}).out);
  using Arguments = std::vector<std::string>;
  for (const Arguments& arguments :
       {Arguments{"patch_match_stereo", "-h"}, Arguments{"patch_match_stereo", "--help"},
        Arguments{"help", "patch_match_stereo"}}) {
    const WatchedResult result = RunPhimvs(arguments);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("--PatchMatchStereo.window_radius arg (=7)"));
    EXPECT_THAT(result.out, HasSubstr("[pixels]"));
    EXPECT_EQ(result.err, "");
  }
}

// With or without what asks for it twice.
TEST(ProgramTest, HelpOfHelpIsTheHelp) {
  const std::string help = RunPhimvs({"--help"}).out;
  for (const char* first : {"help", "--help"}) {
    for (const char* second : {"help", "--help", "-h"}) {
      const WatchedResult result = RunPhimvs({first, second});
      EXPECT_EQ(result.exit_code, 0) << first << " " << second;
      EXPECT_EQ(result.out, help) << first << " " << second;
    }
  }
}

TEST(ProgramTest, HelpTellsTheExitCodesThatThePageHas) {
  std::string help = RunPhimvs({"--help"}).out;
  std::replace(help.begin(), help.end(), '\n', ' ');
  const std::string codes = help.substr(help.find("Exit codes: "));
  std::ifstream page(PHIMVS_SOURCE_DIR "/docs/troubleshooting.md");
  const std::regex row(R"(^\| (\d+(?:, \d+)*) \| (.*) \|$)");
  int num_rows = 0;
  for (std::string line; std::getline(page, line);) {
    std::smatch found;
    if (!std::regex_match(line, found, row)) continue;
    ++num_rows;
    const std::string numbers = std::regex_replace(found[1].str(), std::regex(", "), " and ");
    EXPECT_THAT(codes, ContainsRegex("[ :]" + numbers + " [a-z]"));
    if (numbers != "3") continue;
    EXPECT_THAT(codes, HasSubstr("3 " + found[2].str()));
  }
  EXPECT_EQ(num_rows, 9);
}

// Where there is no terminal, 80 columns.
TEST(ProgramTest, HelpFitsTheUsualTerminal) {
  for (const char* command :
       {"", "dense", "patch_match_stereo", "hole_filler", "stereo_fusion", "workspace_checker", "evaluate",
        "make_scene", "report", "map_inspector", "self_test"}) {
    const std::string help =
        RunPhimvs(*command ? std::vector<std::string>{"help", command} : std::vector<std::string>{"help"})
            .out;
    std::istringstream lines(help);
    std::size_t num_lines = 0;
    for (std::string line; std::getline(lines, line); ++num_lines)
      EXPECT_LE(line.size(), 80u) << command << ": " << line;
    EXPECT_GT(num_lines, 8u) << command;
  }
}

TEST(ProgramTest, UsageErrorsEndWithOne) {
  EXPECT_EQ(RunPhimvs({}).exit_code, 1);
  const WatchedResult unknown = RunPhimvs({"patchmatch"});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.err, HasSubstr("there is no command 'patchmatch'"));
  EXPECT_THAT(RunPhimvs({"stereo_fuson"}).err, HasSubstr("'stereo_fuson' (did you mean stereo_fusion?)"));
  EXPECT_EQ(RunPhimvs({"help", "stereo_fuson"}).exit_code, 1);
  EXPECT_EQ(unknown.out, "");
  const WatchedResult colmaps = RunPhimvs({"poisson_mesher", "--input_path", "fused.ply"});
  EXPECT_EQ(colmaps.exit_code, 1);
  EXPECT_THAT(colmaps.err, HasSubstr("'poisson_mesher' is a command of COLMAP: run `colmap poisson_mesher`"));

  const WatchedResult missing = RunPhimvs({"patch_match_stereo"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, HasSubstr("--workspace_path is required"));
  EXPECT_EQ(RunStereo("x", {"--PatchMatchStereo.no_such_option", "1"}).exit_code, 1);
  const WatchedResult value = RunStereo("x", {"--PatchMatchStereo.geom_consistency", "maybe"});
  EXPECT_EQ(value.exit_code, 1);
  EXPECT_THAT(value.err,
              HasSubstr("--PatchMatchStereo.geom_consistency is 'maybe', but must be true, false, 1 or 0"));
  const WatchedResult range = RunStereo("x", {"--PatchMatchStereo.num_iterations", "0"});
  EXPECT_EQ(range.exit_code, 1);
  EXPECT_THAT(range.err, HasSubstr("--PatchMatchStereo.num_iterations is 0, but must be between 1 and 100"));
  EXPECT_EQ(RunStereo("x", {"--PatchMatchStereo.depth_min", "2"}).exit_code, 1);
  EXPECT_EQ(RunStereo("x", {"--workspace_format", "PMVS"}).exit_code, 1);
}

TEST(ProgramTest, BadInputEndsWithTwoAndNamesIt) {
  const WatchedResult nowhere = RunStereo("/no/such/workspace");
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("/no/such/workspace"));
  const WatchedResult project = RunStereo("x", {"--project_path", "/no/such/file.ini"});
  EXPECT_EQ(project.exit_code, 2);
  EXPECT_EQ(RunStereo("x", {"--project_path", "/tmp"}).exit_code, 2);
  EXPECT_THAT(RunStereo("").err, HasSubstr("--workspace_path is required"));
  EXPECT_THAT(project.err, HasSubstr("/no/such/file.ini"));
  EXPECT_THAT(project.out, Not(HasSubstr("error")));
}

TEST(ProgramTest, ForeignMapsEndWithTwoUnlessOverwritten) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 3});
  const auto foreign = folder / "stereo/depth_maps/a/1.png.photometric.bin";
  test_support::WriteBytes(foreign, "24&16&1&");
  const WatchedResult refused = RunStereo(folder.path());
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr(foreign.string()));
  EXPECT_THAT(refused.err, HasSubstr("--overwrite true"));
  EXPECT_EQ(RunStereo(folder.path(), {"--overwrite", "true"}).exit_code, 0);
  EXPECT_EQ(RunStereo(folder.path()).exit_code, 0);  // by now the maps are ours
}

TEST(ProgramTest, MissingImageEndsWithFourAndTheOthersAreDone) {
  const TemporaryFolder folder;
  const auto names = test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 4});
  std::filesystem::remove(folder / "images" / names[2]);
  const WatchedResult result = RunStereo(folder.path());
  EXPECT_EQ(result.exit_code, 4);
  // Though it is a source of the others too, why it failed is told when that is found, in the end, and nowhere else.
  const std::string why = "the file " + (folder / "images" / names[2]).string() + " is missing or cannot be reached\n";
  const std::string in_the_end = "error: 1 of 4 images failed:\n  " + names[2] + " (photometric): " + why;
  EXPECT_THAT(result.err, HasSubstr("error: image " + names[2] + ": " + why));
  EXPECT_THAT(result.err, HasSubstr(in_the_end + "3 of 4 images done in "));
  const std::size_t first = result.err.find(names[2]), second = result.err.find(names[2], first + why.size());
  EXPECT_EQ(second, result.err.find(in_the_end) + in_the_end.find(names[2])) << result.err;
  EXPECT_EQ(CountMaps(folder.path(), "geometric"), 3);
}

// Its lower half was gray, and the decoder's line on stderr named no file.
TEST(ProgramTest, ADamagedJpegFailsAloneAndIsNamed) {
  const TemporaryFolder folder;
  const auto names = test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 4, .width = 48, .height = 32});
  const std::filesystem::path photo = folder / "images" / names[2], jpeg = folder / "a.jpg";
  colmap_ext::WriteGrayImage(jpeg, colmap_ext::ReadGrayImage(photo));
  std::string bytes = test_support::ReadBytes(jpeg);
  test_support::WriteBytes(photo, bytes.replace(bytes.size() - bytes.size() / 4, 2, "\xFF\xF1"));
  const std::string told = "error: " + photo.string() + ": this JPEG is damaged (Corrupt JPEG data: ";
  const WatchedResult result = RunStereo(folder.path());
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr(told));
  EXPECT_THAT(result.err, Not(HasSubstr("\nCorrupt JPEG data")));
  EXPECT_EQ(CountMaps(folder.path(), "geometric"), 3);
  const test_support::ProgramResult checked =
      test_support::RunProgram({PHIMVS_BINARY, "workspace_checker", "--workspace_path", folder.path()});
  EXPECT_EQ(checked.exit_code, 2);
  EXPECT_THAT(checked.output, HasSubstr(told));
  EXPECT_EQ(checked.errors, "");
}

// Every image that names it as a source reads it once more, and libpng left a line without a name each time.
TEST(ProgramTest, ADamagedPngFailsAloneAndIsNamed) {
  const TemporaryFolder folder;
  const auto names = test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 4, .width = 48, .height = 32});
  const std::filesystem::path photo = folder / "images" / names[2];
  const std::string bytes = test_support::ReadBytes(photo);
  test_support::WriteBytes(photo, bytes.substr(0, bytes.size() / 2));
  const WatchedResult result = RunStereo(folder.path());
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("error: " + photo.string() + ": this PNG is cut short; copy or undistort it again\n"));
  EXPECT_THAT(result.err, Not(HasSubstr("libpng")));
  EXPECT_EQ(CountMaps(folder.path(), "geometric"), 3);
}

TEST(ProgramTest, RenamedPhotosAreOneErrorOfEveryCommandThatReadsThem) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 3});
  ASSERT_EQ(RunStereo(folder.path()).exit_code, 0);
  std::filesystem::rename(folder / "images/a", folder / "images/b");
  const std::string workspace = folder.path().string();
  using Arguments = std::vector<std::string>;
  for (const Arguments& arguments :
       {Arguments{"patch_match_stereo"}, {"dense"}, {"hole_filler"}, {"stereo_fusion", "--output_path", (folder / "c.ply").string()}}) {
    Arguments all = arguments;
    all.insert(all.end(), {"--workspace_path", workspace});
    const WatchedResult result = RunPhimvs(all);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, MatchesRegex("(.*CPU.*\n)?error: [^\n]*/images: none of the 3 images of the sparse model is there, but 3 "
                                         "other files are, such as 'b/0.png', where the model has 'a/0.png';[^\n]*\n"))
        << arguments[0];
  }
  EXPECT_THAT(RunPhimvs({"hole_filler", "--restore", "true", "--workspace_path", workspace}).err, Not(HasSubstr("none of the")));
  // Before patch-match.cfg is read, by which sources are selected.
  std::ofstream(folder / "stereo/patch-match.cfg") << "other.png\n__auto__, 20\n";
  EXPECT_THAT(RunStereo(folder.path()).err, HasSubstr("none of the 3 images"));
}

TEST(ProgramTest, UnwritableWorkspaceIsBadInput) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path());
  std::filesystem::permissions(folder / "stereo",
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_EQ(RunStereo(folder.path()).exit_code, 2);
  std::filesystem::permissions(folder / "stereo", std::filesystem::perms::owner_all);
}

TEST(ProgramTest, SummaryTellsTimesAndMemory) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), {.num_images = 3});
  const WatchedResult result = RunStereo(folder.path());
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("3 images, 24x16, 2 source views each, cpu ("));
  EXPECT_THAT(result.err, ContainsRegex("\n3 images done in [0-9]+ s.*most memory [0-9.]+ GB\n"));
  EXPECT_THAT(result.err, Not(HasSubstr("num_iterations=")));  // all options: at level 3 only
  const WatchedResult detailed = RunStereo(folder.path(), {"--log_level", "3", "--overwrite", "true"});
  EXPECT_THAT(detailed.err, HasSubstr("num_iterations="));
  EXPECT_THAT(detailed.err, HasSubstr("memory: peak "));
}

class InterruptionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const TemporaryFolder clean;
    test_support::WriteNoiseWorkspace(clean.path(), kOptions);
    ASSERT_EQ(RunStereo(clean.path()).exit_code, 0);
    expected_ = test_support::HashMaps(clean.path());
  }

  static constexpr test_support::NoiseWorkspaceOptions kOptions{
      .num_images = 6, .width = 48, .height = 32};
  std::vector<std::string> expected_;
};

TEST_F(InterruptionTest, KilledRunGoesOnToTheBytesOfACleanRun) {
  for (const auto& [kind, num_maps] :
       {std::pair{"photometric", 1}, {"photometric", 4}, {"measured", 2}, {"geometric", 3}}) {
    const TemporaryFolder folder;
    test_support::WriteNoiseWorkspace(folder.path(), kOptions);
    RunStereo(folder.path(), {}, SignalAt(folder.path(), kind, num_maps, SIGKILL));
    const WatchedResult second = RunStereo(folder.path());
    EXPECT_EQ(second.exit_code, 0) << second.err;
    EXPECT_EQ(test_support::HashMaps(folder.path()), expected_) << kind << " " << num_maps;
  }
}

// So many images that on a busy machine, too, the signal comes before the last of them.
TEST_F(InterruptionTest, SignalsStopCleanlyAndSayHowToGoOn) {
  test_support::NoiseWorkspaceOptions options = kOptions;
  options.num_images = 20;
  const TemporaryFolder clean;
  test_support::WriteNoiseWorkspace(clean.path(), options);
  ASSERT_EQ(RunStereo(clean.path()).exit_code, 0);
  const std::vector<std::string> expected = test_support::HashMaps(clean.path());
  for (const int signal : {SIGINT, SIGTERM}) {
    const TemporaryFolder folder;
    test_support::WriteNoiseWorkspace(folder.path(), options);
    const WatchedResult first =
        RunStereo(folder.path(), {}, SignalAt(folder.path(), "photometric", 1, signal));
    EXPECT_EQ(first.exit_code, 128 + signal);
    EXPECT_THAT(first.err, HasSubstr("the same command goes on where this one stopped"));
    const int num_kept = CountMaps(folder.path(), "photometric");
    EXPECT_GE(num_kept, 1);
    EXPECT_LT(num_kept, options.num_images);
    EXPECT_EQ(RunStereo(folder.path()).exit_code, 0);
    EXPECT_EQ(test_support::HashMaps(folder.path()), expected);
  }
}

TEST_F(InterruptionTest, BytesDependOnNeitherThreadsNorCache) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), kOptions);
  EXPECT_EQ(RunStereo(folder.path(),
                      {"--PatchMatchStereo.num_threads", "1", "--PatchMatchStereo.cache_size", "1e-6"})
                .exit_code,
            0);
  EXPECT_EQ(test_support::HashMaps(folder.path()), expected_);
}

TEST_F(InterruptionTest, TerminalShowsABar) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), kOptions);
  const WatchedResult result = RunStereo(folder.path(), {}, {.terminal = true, .while_running = {}});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, ContainsRegex("\r.\\[J\\[[#.]+\\] [0-9]+ %, "));
}

// Of 40 columns, the last of which stays free, since a full row would move to the next.
TEST_F(InterruptionTest, BarFitsTheTerminal) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), kOptions);
  const WatchedResult result = RunStereo(folder.path(), {}, {.terminal = true, .columns = 40});
  const std::string begin = "\r\033[J";
  int num_bars = 0;
  for (std::size_t at = result.err.find(begin); at != std::string::npos; at = result.err.find(begin, at)) {
    at += begin.size();
    const std::string bar = result.err.substr(at, result.err.find_first_of("\r\n", at) - at);
    if (!bar.starts_with("[")) continue;  // a line of log
    ++num_bars;
    EXPECT_LE(bar.size(), 39u) << bar;
  }
  EXPECT_GT(num_bars, 0);
}

TEST_F(InterruptionTest, SecondProcessInTheSameWorkspaceIsRefused) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), kOptions);
  WatchedResult second;
  bool tried = false;
  RunStereo(folder.path(), {}, {.while_running = [&](pid_t pid) {
              if (tried || CountMaps(folder.path(), "photometric") < 1) return;
              tried = true;
              kill(pid, SIGSTOP);
              second = RunStereo(folder.path());
              kill(pid, SIGCONT);
            }});
  ASSERT_TRUE(tried);
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_THAT(second.err, HasSubstr("another phimvs is at work"));
}

TEST(ProgramTest, StatusOfARunThatHasJustBegunIsNoError) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path());
  const std::vector<std::string> status = {"status", "--workspace_path", folder.path().string()};
  EXPECT_THAT(RunPhimvs(status).err, HasSubstr("has not run here yet"));
  EXPECT_THAT(RunPhimvs({"status", "--workspace_path", (folder / "images").string()}).err,
              HasSubstr("--workspace_path: " + (folder / "images").string() + " holds no stereo folder"));
  const colmap_ext::WorkspaceLock lock(folder / "stereo");
  const WatchedResult result = RunPhimvs(status);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("a run is at work on this computer"));
}

// Which takes minutes for a large model: `status` must see the run, and a second one must not begin.
TEST(ProgramTest, AWorkspaceIsLockedBeforeSourcesAreSelected) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path());
  std::ofstream(folder / "stereo/patch-match.cfg") << "other.png\n__auto__, 20\n";
  const colmap_ext::WorkspaceLock lock(folder / "stereo");
  EXPECT_THAT(RunStereo(folder.path()).err, HasSubstr("another phimvs is at work"));
  EXPECT_THAT(RunPhimvs({"hole_filler", "--workspace_path", folder.path().string()}).err, HasSubstr("another phimvs is at work"));
}

// As dense --keep cloud leaves it: runs, and no results.
TEST(ProgramTest, StatusKnowsThatMapsWereRemoved) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path());
  colmap_ext::RunRecord record(folder / "stereo");
  record.AddRun("{}");
  record.Compact();
  const WatchedResult result = RunPhimvs({"status", "--workspace_path", folder.path().string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "no maps by phimvs: dense --keep cloud removed them, or hole_filler --restore put the earlier ones back\n");
}

// Killed outright, a run leaves its record as it was at work.
TEST_F(InterruptionTest, StatusTellsWhetherSomebodyIsAtWork) {
  const TemporaryFolder folder;
  test_support::WriteNoiseWorkspace(folder.path(), kOptions);
  const std::vector<std::string> status = {"status", "--workspace_path", folder.path().string()};
  std::string while_running;
  RunStereo(folder.path(), {}, {.while_running = [&](pid_t pid) {
              if (!while_running.empty() || CountMaps(folder.path(), "photometric") < 1) return;
              kill(pid, SIGSTOP);
              while_running = RunPhimvs(status).out;
              kill(pid, SIGKILL);
            }});
  const std::string go_on = "no run is at work on this computer; the same command goes on where the last one stopped\n";
  EXPECT_THAT(while_running, AllOf(HasSubstr("\na run is at work on this computer\n"), HasSubstr("time left: "),
                                   Not(HasSubstr(go_on))));
  EXPECT_THAT(RunPhimvs(status).out, AllOf(HasSubstr(go_on), Not(HasSubstr("a run is at")), Not(HasSubstr("time left"))));
  ASSERT_EQ(RunStereo(folder.path()).exit_code, 0);
  EXPECT_THAT(RunPhimvs(status).out, Not(HasSubstr("at work")));
}

}  // namespace
