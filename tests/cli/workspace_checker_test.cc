// The command as its user meets it: what it prints, and its exit code.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/run_program.h"
#include "tests/support/small_workspace.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

using test_support::ProgramResult;
using test_support::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

ProgramResult Check(const std::filesystem::path& workspace, const std::string& format = "COLMAP") {
  return test_support::RunProgram({PHIMVS_BINARY, "workspace_checker", "--workspace_path", workspace.string(),
                                   "--workspace_format", format});
}

TEST(WorkspaceCheckerTest, EndsWellOnAGoodWorkspace) {
  const TemporaryFolder folder;
  test_support::WriteSmallWorkspace(folder.path());
  const ProgramResult result = Check(folder.path());
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("warning: "), HasSubstr("1 of 3 images see no sparse point, 'c.png' the first"),
                    HasSubstr("3 images, 3 to estimate, 2 sparse points; 0 errors, 1 warnings")));
}

TEST(WorkspaceCheckerTest, PrintsEveryErrorAndEndsWithTwo) {
  const TemporaryFolder folder;
  test_support::WriteSmallWorkspace(folder.path());
  std::filesystem::remove(folder / "images/a.png");
  std::filesystem::remove(folder / "stereo/fusion.cfg");
  const ProgramResult result = Check(folder.path());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("error: " + (folder / "images/a.png").string()),
                    HasSubstr("error: " + (folder / "stereo/fusion.cfg").string()), HasSubstr("2 errors")));
}

TEST(WorkspaceCheckerTest, ReadsMasks) {
  const TemporaryFolder folder;
  test_support::WriteSmallWorkspace(folder.path());
  test_support::WriteBytes(folder / "masks/a.png.png", "no image");
  for (const char* option : {"--PhiStereo.mask_path", "--StereoFusion.mask_path"}) {
    const ProgramResult result = test_support::RunProgram(
        {PHIMVS_BINARY, "workspace_checker", "--workspace_path", folder.path().string(), option, (folder / "masks").string()});
    EXPECT_EQ(result.exit_code, 2) << option << result.errors;
    EXPECT_THAT(result.output, AllOf(HasSubstr("error: " + (folder / "masks/a.png.png").string()),
                                     HasSubstr("2 of 3 images have no mask")))
        << option;
  }
}

TEST(WorkspaceCheckerTest, RefusesPmvsAsAWrongOption) {
  const TemporaryFolder folder;
  const ProgramResult result = Check(folder.path(), "PMVS");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("--workspace_format PMVS is not supported"));
}

}  // namespace
}  // namespace colmap_ext
