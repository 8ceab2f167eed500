// scripts/colmap-phi with a fake COLMAP and a fake phimvs that say who was called, and how.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using test_support::ProgramResult;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using testing::HasSubstr;

namespace fs = std::filesystem;

void WriteProgram(const fs::path& path, const std::string& body) {
  test_support::WriteBytes(path, "#!/bin/sh\n" + body);
  fs::permissions(path, fs::perms::owner_all);
}

class ColmapWrapper : public testing::Test {
 protected:
  ColmapWrapper() {
    WriteProgram(folder_ / "real/colmap", "echo \"real colmap: $*\"\nexit 7\n");
    WriteProgram(folder_ / "bin/phimvs", "echo \"phimvs: $*\"\nexit 3\n");
    fs::create_directories(folder_ / "ahead");
    fs::copy_file(fs::path(PHIMVS_SOURCE_DIR) / "scripts/colmap-phi", folder_ / "ahead/colmap");
  }

  // Calls `colmap` as another program would, with the stand-in ahead on PATH.
  ProgramResult Colmap(std::vector<std::string> arguments, std::vector<std::string> environment = {}) {
    const std::string path = (folder_ / "ahead").string() + ":" + (folder_ / "bin").string() + ":" +
                             (folder_ / "real").string() + ":/usr/bin:/bin";
    environment.insert(environment.begin(), "PATH=" + path);
    arguments.insert(arguments.begin(), "colmap");
    return RunProgram(arguments, environment);
  }

  TemporaryFolder folder_;
};

TEST_F(ColmapWrapper, PassesOtherCommandsThroughWithTheirExitCode) {
  const ProgramResult result = Colmap({"feature_extractor", "--database_path", "a b.db"});
  EXPECT_EQ(result.output, "real colmap: feature_extractor --database_path a b.db\n");
  EXPECT_EQ(result.exit_code, 7);
  EXPECT_EQ(Colmap({"-h"}).output, "real colmap: -h\n");
  EXPECT_EQ(Colmap({}).output, "real colmap: \n");
}

TEST_F(ColmapWrapper, TakesOverPatchMatchStereo) {
  const ProgramResult result = Colmap({"patch_match_stereo", "--workspace_path", "dense"});
  EXPECT_EQ(result.output, "phimvs: patch_match_stereo --workspace_path dense\n");
  EXPECT_EQ(result.exit_code, 3);
}

// COLMAP makes two sparse models, with --dense 0 whatever was asked. Its image_undistorter does not make the folder above its
// output.
TEST_F(ColmapWrapper, MakesTheDenseModelsOfAutomaticReconstructor) {
  const std::string project = (folder_ / "project").string();
  WriteProgram(
      folder_ / "real/colmap",
      "echo \"real colmap: $*\"\nmkdir -p " + project + "/sparse/0 " + project +
          "/sparse/1\n[ $1 != image_undistorter ] || [ -d $(dirname $7) ] || exit 9\n" +
          "[ $1 != poisson_mesher ] || printf 'ply\\nelement face %s\\n' ${3#*dense/} | cut -d/ -f1 > $5\n");
  WriteProgram(folder_ / "bin/phimvs", "echo \"phimvs: $*\"\n");
  const ProgramResult result = Colmap({"automatic_reconstructor", "--workspace_path", project, "--image_path",
                                       "photos", "--quality", "medium"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  std::string expected = "real colmap: automatic_reconstructor --workspace_path " + project +
                         " --image_path photos --quality medium --dense 0\n";
  for (const std::string model : {"0", "1"}) {
    const std::string dense = project + "/dense/" + model;
    expected += "real colmap: image_undistorter --image_path photos --input_path " + project + "/sparse/" +
                model + "/ --output_path " + dense +
                " --max_image_size 1600\nphimvs: dense --workspace_path " + dense +
                "\nreal colmap: poisson_mesher --input_path " + dense + "/fused.ply --output_path " + dense +
                "/meshed-poisson.ply\n";
  }
  EXPECT_EQ(result.output, expected);
  // The mesh of model 0 has no face, that of model 1 one.
  EXPECT_THAT(result.errors, HasSubstr("dense/0/meshed-poisson.ply has no faces"));
  EXPECT_THAT(result.errors, testing::Not(HasSubstr("dense/1/meshed-poisson.ply has no faces")));
}

// COLMAP has made two sparse models, and says what it undistorts and meshes.
class ColmapWrapperDense : public ColmapWrapper {
 protected:
  ColmapWrapperDense() {
    fs::create_directories(project_ / "sparse/0");
    fs::create_directories(project_ / "sparse/1");
    WriteProgram(folder_ / "real/colmap", "case $1 in image_undistorter | poisson_mesher) echo \"$1 ${5#*dense/}\" ;; esac\n");
  }

  ProgramResult Reconstruct(const fs::path& images) {
    return Colmap({"automatic_reconstructor", "--workspace_path", project_, "--image_path", images});
  }

  const fs::path project_ = folder_ / "project";
};

TEST_F(ColmapWrapperDense, GoesOnWhereSomeImagesFailed) {
  WriteProgram(folder_ / "bin/phimvs", "case $3 in */0) exit 4 ;; esac\n");
  const ProgramResult result = Reconstruct("photos");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.output, HasSubstr("poisson_mesher 0/meshed-poisson.ply\n"));
  EXPECT_THAT(result.output, HasSubstr("poisson_mesher 1/meshed-poisson.ply\n"));

  WriteProgram(folder_ / "bin/phimvs", "exit 3\n");
  const ProgramResult failed = Reconstruct("photos");
  EXPECT_EQ(failed.exit_code, 3);
  EXPECT_THAT(failed.output, testing::Not(HasSubstr("poisson_mesher")));
}

TEST_F(ColmapWrapperDense, RepeatsAnUndistortionThatWasStopped) {
  WriteProgram(folder_ / "bin/phimvs", "");
  const fs::path stopped = project_ / "dense/0/images/a.jpg", whole = project_ / "dense/1/images/a.jpg";
  test_support::WriteBytes(stopped, "half");
  test_support::WriteBytes(whole, "whole");
  test_support::WriteBytes(project_ / "dense/1/stereo/fusion.cfg", "a.jpg\n");
  const std::string undistorted = "image_undistorter " + (project_ / "sparse/").string();
  const ProgramResult result = Reconstruct(folder_ / "photos");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr(undistorted + "0/\n"));
  EXPECT_THAT(result.output, testing::Not(HasSubstr(undistorted + "1/\n")));
  EXPECT_FALSE(fs::exists(stopped)) << "COLMAP does not copy over it";
  EXPECT_TRUE(fs::exists(whole));

  test_support::WriteBytes(stopped, "the photo itself");
  EXPECT_THAT(Reconstruct(stopped.parent_path()).output, HasSubstr(undistorted + "0/\n"));
  EXPECT_EQ(test_support::ReadBytes(stopped), "the photo itself");
}

// As COLMAP 3.8 does where it finds no display for its features on the GPU. It aborts as well where there is no workspace.
TEST_F(ColmapWrapper, SaysWhatToTryWithoutADisplay) {
  const fs::path project = folder_ / "project";
  WriteProgram(folder_ / "real/colmap", "test -d " + project.string() + " || exit 9\nkill -ABRT $$\n");
  const std::vector<std::string> words = {"automatic_reconstructor", "--workspace_path", project,
                                          "--image_path", "photos"};
  const std::vector<std::string> no_display = {"DISPLAY=", "WAYLAND_DISPLAY="};
  const ProgramResult result = Colmap(words, no_display);
  EXPECT_EQ(result.exit_code, 128 + SIGABRT);
  EXPECT_EQ(result.output, "");
  EXPECT_THAT(result.errors, HasSubstr("try --use_gpu 0"));
  for (const auto& [more, environment] :
       {std::pair(std::vector<std::string>{"--use_gpu", "0"}, no_display),
        std::pair(std::vector<std::string>(), std::vector<std::string>{"DISPLAY=:0"})}) {
    std::vector<std::string> others = words;
    others.insert(others.end(), more.begin(), more.end());
    EXPECT_THAT(Colmap(others, environment).errors, testing::Not(HasSubstr("use_gpu")));
  }
}

TEST_F(ColmapWrapper, LeavesAReconstructionWithoutDenseModelToColmap) {
  const ProgramResult result = Colmap({"automatic_reconstructor", "--workspace_path", "w", "--dense", "0"});
  EXPECT_EQ(result.output, "real colmap: automatic_reconstructor --workspace_path w --dense 0\n");
  EXPECT_EQ(result.exit_code, 7);
}

TEST_F(ColmapWrapper, TakesOverStereoFusionOnRequestOnly) {
  EXPECT_EQ(Colmap({"stereo_fusion"}).output, "real colmap: stereo_fusion\n");
  EXPECT_EQ(Colmap({"stereo_fusion"}, {"PHIMVS_STEREO_FUSION=1"}).output, "phimvs: stereo_fusion\n");
}

TEST_F(ColmapWrapper, DoesNotCallItselfWhenInstalledTwice) {
  fs::copy_file(folder_ / "ahead/colmap", folder_ / "bin/colmap");
  EXPECT_EQ(Colmap({"gui"}).output, "real colmap: gui\n");
}

TEST_F(ColmapWrapper, TakesProgramsFromTheEnvironment) {
  WriteProgram(folder_ / "other", "echo \"other: $*\"\n");
  EXPECT_EQ(Colmap({"gui"}, {"PHIMVS_COLMAP=" + (folder_ / "other").string()}).output, "other: gui\n");
  EXPECT_EQ(Colmap({"patch_match_stereo"}, {"PHIMVS_PROGRAM=" + (folder_ / "other").string()}).output,
            "other: patch_match_stereo\n");
}

TEST_F(ColmapWrapper, SaysWhenThereIsNoRealColmap) {
  fs::remove(folder_ / "real/colmap");
  // A PATH with the tools that the stand-in needs and no COLMAP.
  fs::create_directories(folder_ / "tools");
  for (const char* tool : {"bash", "env", "head", "grep", "dirname", "readlink"}) {
    for (const char* bin : {"/usr/bin/", "/bin/"}) {
      if (!fs::exists(folder_ / "tools" / tool) && fs::exists(std::string(bin) + tool)) {
        fs::create_symlink(std::string(bin) + tool, folder_ / "tools" / tool);
      }
    }
  }
  const ProgramResult alone = RunProgram(
      {"colmap", "gui"}, {"PATH=" + (folder_ / "ahead").string() + ":" + (folder_ / "tools").string()});
  EXPECT_EQ(alone.exit_code, 127);
  EXPECT_THAT(alone.errors, HasSubstr("PHIMVS_COLMAP"));
}

}  // namespace
