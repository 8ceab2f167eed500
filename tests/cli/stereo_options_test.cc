#include "colmap_ext/cli/stereo_options.h"

#include <vector>

#include <gtest/gtest.h>

namespace colmap_ext {
namespace {

PipelineOptions Parsed(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), {"phimvs", "--workspace_path", "w", "--log_level", "0"});
  OptionParser parser("patch_match_stereo", "test");
  StereoCommandOptions options;
  options.Register(&parser);
  EXPECT_TRUE(parser.Parse(static_cast<int>(arguments.size()), arguments.data()));
  options.Finish(parser);
  return options.pipeline;
}

TEST(StereoOptions, FastLeavesTheCountOfIterations) {
  EXPECT_EQ(Parsed({}).stereo.quality, phi::Quality::kStandard);
  const auto fast = Parsed({"--PhiStereo.quality", "fast"}).stereo;
  EXPECT_EQ(fast.quality, phi::Quality::kFast);
  EXPECT_EQ(fast.num_iterations, 8);
}

TEST(StereoOptions, PaperFormulasComeWithThePapersNormalError) {
  EXPECT_EQ(Parsed({}).filter.max_normal_error, 60);
  EXPECT_EQ(Parsed({"--PhiStereo.formulas", "paper"}).filter.max_normal_error, 30);
}

TEST(StereoOptions, GuidedPassesArePartOfTheIterations) {
  EXPECT_EQ(Parsed({}).NumGuidedPasses(), 0);
  EXPECT_EQ(Parsed({"--PhiStereo.num_guided_passes", "3"}).NumGuidedPasses(), 3);
  EXPECT_EQ(Parsed({"--PhiStereo.num_guided_passes", "9", "--PatchMatchStereo.num_iterations", "5"})
                .NumGuidedPasses(),
            4);
  EXPECT_EQ(Parsed({"--PhiStereo.num_guided_passes", "3", "--PhiStereo.formulas", "paper"}).NumGuidedPasses(),
            0);
}

}  // namespace
}  // namespace colmap_ext
