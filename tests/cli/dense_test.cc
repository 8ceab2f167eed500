#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_ext/evaluation/ply_rows.h"
#include "tests/support/run_on_workspace.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

using test_support::ProgramResult;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using testing::HasSubstr;

class DenseCommand : public testing::Test {
 protected:
  DenseCommand() { test_support::MakeRoom(folder_.path(), 120, 90, 4); }

  ProgramResult Dense(std::vector<std::string> more) {
    std::vector<std::string> command{PHIMVS_BINARY, "dense", "--workspace_path", folder_ / "room/dense"};
    command.insert(command.end(), more.begin(), more.end());
    return RunProgram(command);
  }

  TemporaryFolder folder_;
};

TEST_F(DenseCommand, GoesFromWorkspaceToCloudAndReport) {
  const ProgramResult result = Dense(
      {"--PhiStereo.quality", "fast", "--StereoFusion.min_num_pixels", "2", "--default_random_seed", "3"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto cloud = folder_ / "room/dense/fused.ply";
  ASSERT_TRUE(std::filesystem::exists(cloud)) << result.errors;
  // 120 x 90 pixels seen from four places: a cloud of a few points would mean that the steps did not fit together.
  EXPECT_GT(colmap_ext::PlyRows(cloud).Find("vertex")->count, 1000u);
  const std::string record = test_support::ReadBytes(folder_ / "room/dense/stereo/phimvs.json");
  EXPECT_THAT(record, HasSubstr("\"PhiStereo.quality\": \"fast\"")) << "the option reached the stereo step";
  EXPECT_THAT(record, HasSubstr("\"default_random_seed\": \"3\""));
  EXPECT_THAT(test_support::ReadBytes(folder_ / "room/dense/report.html"), HasSubstr("\"num_shown\""));
}

TEST_F(DenseCommand, RefusesAMistakeInFusionsOptionsBeforeTheStereo) {
  const ProgramResult result = Dense({"--StereoFusion.min_num_pixels", "-5"});
  EXPECT_EQ(result.exit_code, 1) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("min_num_pixels"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "room/dense/stereo/phimvs.json"));
}

}  // namespace
