// scripts/seven_scenes: what `make` removes before it begins. A module without content stands in for pycolmap.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::WriteBytes;
using testing::HasSubstr;

class SevenScenes : public testing::Test {
 protected:
  void SetUp() override {
    if (RunProgram({"python3", "-c", "import numpy"}).exit_code != 0) GTEST_SKIP() << "no python3 with numpy";
    WriteBytes(folder_ / "modules/pycolmap.py", "");
  }

  ProgramResult Make(const fs::path& frames, const fs::path& output) {
    return RunProgram({"python3", PHIMVS_SOURCE_DIR "/scripts/seven_scenes", "make", frames, output},
                      {"PYTHONDONTWRITEBYTECODE=1", "PYTHONPATH=" + (folder_ / "modules").string()});
  }

  test_support::TemporaryFolder folder_;
};

TEST_F(SevenScenes, LeavesTheRecordingWhereItIsOneOfTheFoldersToMake) {
  fs::create_directory_symlink(folder_ / "walk", folder_ / "link");
  for (const char* frames : {"walk", "walk/images", "walk/dense/recording"}) {
    const fs::path photo = fs::path(frames) / "frame-000000.color.png";
    WriteBytes(folder_ / photo, "pixels");
    for (const char* output : {"walk", "link"}) {
      const ProgramResult result = Make(folder_ / frames, folder_ / output);
      EXPECT_EQ(result.exit_code, 1);
      EXPECT_THAT(result.errors, HasSubstr("name another output folder"));
      ASSERT_TRUE(fs::exists(folder_ / photo)) << frames << " " << output;
    }
    fs::remove_all(folder_ / "walk");
  }
}

TEST_F(SevenScenes, AWrongFolderOfFramesRemovesNothing) {
  WriteBytes(folder_ / "walk/images/frame-000000.color.png", "of an earlier run");
  EXPECT_THAT(Make(folder_ / "none", folder_ / "walk").errors, HasSubstr("no frame-NNNNNN.color.*"));
  EXPECT_EQ(ReadBytes(folder_ / "walk/images/frame-000000.color.png"), "of an earlier run");
}

// Beside the recording, what an earlier run left goes. The module has no extract_features, which is what comes then.
TEST_F(SevenScenes, ReplacesWhatAnEarlierRunLeft) {
  WriteBytes(folder_ / "recording/frame-000013.color.png", "pixels");
  WriteBytes(folder_ / "walk/images/frame-000000.color.png", "of an earlier run");
  EXPECT_THAT(Make(folder_ / "recording", folder_ / "walk").errors, HasSubstr("extract_features"));
  EXPECT_FALSE(fs::exists(folder_ / "walk/images/frame-000000.color.png"));
  EXPECT_EQ(ReadBytes(folder_ / "walk/images/frame-000013.color.png"), "pixels");
}

}  // namespace
