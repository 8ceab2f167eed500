#include "colmap_ext/cli/stereo_options.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_ext/pipeline/stage_graph.h"
#include "phi/base/error.h"
#include "tests/support/log_capture.h"

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

// The paper's section IV, and its section III for the filter.
TEST(StereoOptions, ThePaperPresetSetsThePapersValues) {
  const PipelineOptions paper = Parsed({"--preset", "paper"});
  EXPECT_EQ(paper.stereo.method.formulas, phi::Formulas::kPaper);
  EXPECT_EQ(paper.view_selection.method.formulas, phi::Formulas::kPaper);
  EXPECT_EQ(paper.filter.method.formulas, phi::Formulas::kPaper);
  EXPECT_EQ(paper.inference.method.formulas, phi::Formulas::kPaper);
  EXPECT_EQ(paper.view_selection.num_source_views, 8);
  EXPECT_EQ(paper.view_selection.NumSelectedViews(), 8);
  EXPECT_EQ(paper.view_selection.min_displacement, 0.1);
  EXPECT_EQ(paper.view_selection.displacement_epsilon, 0.002);
  EXPECT_EQ(paper.view_selection.min_triangulation_angle, 0);
  EXPECT_EQ(paper.stereo.window_radius, 7);
  EXPECT_EQ(paper.stereo.SamplesPerSide(), 5);
  EXPECT_EQ(paper.stereo.num_window_levels, 1);
  EXPECT_EQ(paper.stereo.num_iterations, 8);
  EXPECT_EQ(paper.filter.max_depth_error, 0.02);
  EXPECT_EQ(paper.filter.max_normal_error, 30);
  EXPECT_EQ(paper.filter.max_reprojection_error, 1);
  EXPECT_EQ(paper.filter.min_num_consistent, 2);
  EXPECT_EQ(paper.filter.min_num_consistent_inferred, 2);  // "more than one", whatever made the pixel
  EXPECT_EQ(paper.inference.mode, phi::InferenceMode::kMrf);
  EXPECT_EQ(paper.inference.num_passes, 1);
  EXPECT_EQ(paper.inference.kappa1, 4);
  EXPECT_EQ(paper.inference.kappa2, 0.5);
  EXPECT_EQ(paper.inference.kappa3, 2);
  for (const Stage& stage : BuildStages(paper)) EXPECT_FALSE(stage.judges_measurements);
}

TEST(StereoOptions, WithoutAPresetTheDefaultsStay) {
  const PipelineOptions robust = Parsed({});
  EXPECT_EQ(robust.stereo.method.formulas, phi::Formulas::kRobust);
  EXPECT_EQ(robust.filter.max_normal_error, 60);
  EXPECT_EQ(robust.filter.max_depth_error, 0);
  EXPECT_EQ(Parsed({"--preset", "robust"}).filter.max_normal_error, 60);
  EXPECT_THROW(Parsed({"--preset", "papers"}), phi::UsageError);
}

TEST(StereoOptions, WhatIsSetGoesBeforeThePreset) {
  const PipelineOptions both = Parsed({"--PhiStereo.num_window_levels", "3", "--preset", "paper"});
  EXPECT_EQ(both.stereo.num_window_levels, 3);
  EXPECT_EQ(both.stereo.method.formulas, phi::Formulas::kPaper);
  EXPECT_EQ(
      Parsed({"--preset", "paper", "--PhiStereo.min_displacement", "0.02"}).view_selection.min_displacement,
      0.02);
  EXPECT_EQ(Parsed({"--preset", "paper", "--PhiStereo.filter_max_relative_depth_error", "0.01"})
                .filter.max_depth_error,
            0);
}

TEST(StereoOptions, TheLogSaysWhatGoesBeforeThePreset) {
  const test_support::LogCapture log;
  OptionParser parser("patch_match_stereo", "test");
  StereoCommandOptions options;
  options.Register(&parser);
  const std::vector<const char*> arguments = {
      "phimvs", "--workspace_path",    "w",   "--preset", "paper", "--PhiStereo.num_window_levels",
      "3",      "--PhiStereo.quality", "fast"};
  ASSERT_TRUE(parser.Parse(static_cast<int>(arguments.size()), arguments.data()));
  options.Finish(parser);
  using testing::Contains, testing::HasSubstr;
  EXPECT_THAT(log.messages(),
              Contains(HasSubstr("--PhiStereo.num_window_levels 3 goes before the 1 of --preset paper")));
  EXPECT_THAT(log.messages(), Contains(HasSubstr("--PhiStereo.quality has no effect")));
  EXPECT_THAT(log.messages(), Contains(HasSubstr("options: ")));
  EXPECT_EQ(parser.EffectiveValues().at("PhiStereo.formulas"), "paper");
}

}  // namespace
}  // namespace colmap_ext
