// Every rule's switch reaches the code: turned off (scaled, where it cannot be off), it changes the maps or the cloud of a room.
// Rules that the room does not need are tested where they are: kTestedElsewhere says where.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "phi/base/rules.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using phi::RuleDescription;
using phi::RuleSettings;
using phi::RuleStage;
using test_support::ProgramResult;
using test_support::ReadBytes;
using test_support::RunProgram;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::Not;

const std::set<std::string> kTestedElsewhere = {
    "view_coverage",  "weak_views",  // view_selection_test.cc
    "image_corrections",  // given_poses_test.cc: the poses must be wrong
    "few_views",       // consistency_test.cc: at least two views must be asked for
    "empty_views",     // consistency_test.cc: of three views no four find nothing
    "overexposed",     // region_planes_test.cc
    "photo_tones",     // pooled_anchors_test.cc: the room's images have one tone
    "light_sources",   // light_sources_test.cc: the room has none
    "mirrors",         // mirror_test.cc: the same
    "sky_rims",        // sky_rims_test.cc: the same
    "continued_regions",  // continued_regions_test.cc: nothing parts the room's walls
    "right_angles",    // plane_choice_test.cc: it decides no region of three small views
    "shaded_surfaces",  // shaded_surface_test.cc: a region must be bent
    "spot_brightness",  // plane_choice_test.cc
    "sky",             // region_sky_test.cc
    "map_noise",        // scene_fusion_test.cc
};

ProgramResult Phimvs(std::vector<std::string> words) {
  words.insert(words.begin(), PHIMVS_BINARY);
  return RunProgram(words);
}

// The maps and the cloud of a folder's dense/, by path.
std::map<std::string, std::string> Results(const fs::path& dense) {
  std::map<std::string, std::string> bytes;
  for (const auto& entry : fs::recursive_directory_iterator(dense)) {
    const std::string extension = entry.path().extension();
    if (entry.is_regular_file() && (extension == ".bin" || extension == ".ply" || extension == ".png"))
      bytes[fs::relative(entry.path(), dense)] = ReadBytes(entry.path());
  }
  return bytes;
}

// The room's maps and cloud with all rules as they are, and copies of them to run again.
class RulesOfRoom : public testing::TestWithParam<RuleStage> {
 protected:
  void SetUp() override {
    ASSERT_EQ(Phimvs({"make_scene", "--output_path", folder_ / "room", "--width", "256", "--height", "192",
                      "--num_views", "3"})
                  .exit_code,
              0);
    fs::rename(folder_ / "room/dense", folder_ / "as_is");
    Run(folder_ / "as_is", {});
  }

  static void Run(const fs::path& dense, const std::vector<std::string>& options) {
    std::vector<std::string> words = {"dense", "--workspace_path", dense, "--PhiStereo.backend", "cpu"};
    words.insert(words.end(), options.begin(), options.end());
    const ProgramResult run = Phimvs(words);
    ASSERT_EQ(run.exit_code, 0) << run.errors;
  }

  // With one rule set.
  std::map<std::string, std::string> With(const std::string& option, const std::string& setting) {
    const fs::path dense = folder_ / "other";
    fs::remove_all(dense);
    fs::copy(folder_ / "as_is", dense, fs::copy_options::recursive);
    Run(dense, {option, setting});
    return Results(dense);
  }

  TemporaryFolder folder_;
};

TEST_P(RulesOfRoom, EachChangesResults) {
  const std::map<std::string, std::string> as_is = Results(folder_ / "as_is");
  const std::string option = GetParam() == RuleStage::kFusion ? "--PhiFusion.rules" : "--PhiStereo.rules";
  for (const RuleDescription& rule : phi::kRules) {
    if (rule.stage != GetParam() || kTestedElsewhere.contains(rule.name)) continue;
    const std::string setting =
        std::string(rule.name) + (rule.settings == RuleSettings::kScale ? "=0.7" : "=0");
    EXPECT_FALSE(With(option, setting) == as_is) << setting;
  }
}

INSTANTIATE_TEST_SUITE_P(Stages, RulesOfRoom,
                         testing::Values(RuleStage::kEstimation, RuleStage::kFilter, RuleStage::kInference,
                                         RuleStage::kFusion));

TEST(RulesOption, UnknownNamesAreRefused) {
  for (const char* setting : {"no_such_rule=0", "own_texture", "cover=0"}) {
    const ProgramResult run =
        Phimvs({"patch_match_stereo", "--workspace_path", "/nowhere", "--PhiStereo.rules", setting});
    EXPECT_EQ(run.exit_code, 1) << setting;
    EXPECT_THAT(run.errors,
                HasSubstr("--PhiStereo.rules is '" + std::string(setting) + "', but must be NAME=FACTOR"))
        << setting;
  }
}

TEST(RulesOption, IsForDevelopersAlone) {
  for (const char* command : {"patch_match_stereo", "hole_filler", "stereo_fusion", "dense"}) {
    EXPECT_THAT(Phimvs({command, "--help"}).output, Not(HasSubstr(".rules"))) << command;
    EXPECT_THAT(Phimvs({command, "--help_json"}).output, Not(HasSubstr(".rules"))) << command;
  }
}

}  // namespace
