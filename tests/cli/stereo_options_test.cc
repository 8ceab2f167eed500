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

TEST(StereoOptions, FastMeansFewerIterations) {
  const PipelineOptions standard = Parsed({}), fast = Parsed({"--PhiStereo.quality", "fast"});
  EXPECT_EQ(standard.stereo.num_iterations, 8);
  EXPECT_EQ(standard.NumGuidedPasses(), 4);
  EXPECT_EQ(fast.stereo.num_iterations, 5);
  EXPECT_EQ(fast.NumGuidedPasses(), 2);
}

TEST(StereoOptions, GivenIterationsGoBeforeQuality) {
  const PipelineOptions options =
      Parsed({"--PhiStereo.quality", "fast", "--PatchMatchStereo.num_iterations", "8"});
  EXPECT_EQ(options.stereo.num_iterations, 8);
  EXPECT_EQ(options.num_guided_passes, 2);
  EXPECT_EQ(Parsed({"--PhiStereo.quality", "fast", "--PhiStereo.num_guided_passes", "0"}).num_guided_passes,
            0);
}

}  // namespace
}  // namespace colmap_ext
