#include "colmap_ext/cli/stereo_options.h"

#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_ext/cli/shard_options.h"
#include "colmap_ext/pipeline/stage_graph.h"
#include "phi/base/error.h"
#include "tests/support/error_message.h"
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

// Of a task of Slurm's array FIRST-LAST.
Shard ShardOfTask(int index, int first, int last, int num_shards = 0) {
  const std::pair<const char*, int> variables[] = {{"SLURM_ARRAY_TASK_ID", index},
                                                   {"SLURM_ARRAY_TASK_MIN", first},
                                                   {"SLURM_ARRAY_TASK_MAX", last},
                                                   {"SLURM_ARRAY_TASK_COUNT", last - first + 1}};
  for (const auto& [name, value] : variables) ::setenv(name, std::to_string(value).c_str(), 1);
  const auto restore = [&] {
    for (const auto& [name, value] : variables) ::unsetenv(name);
  };
  try {
    const test_support::LogCapture quiet;
    ShardOptions options;
    options.num_shards = num_shards;
    const Shard shard = options.Resolve();
    restore();
    return shard;
  } catch (...) {
    restore();
    throw;
  }
}

TEST(ShardOptions, AnArrayOfAllShardsSaysWhichOneATaskIs) {
  EXPECT_EQ(ShardOfTask(3, 0, 7).Name(), "3/8");
  EXPECT_EQ(ShardOfTask(3, 1, 8).Name(), "2/8");
  EXPECT_EQ(ShardOfTask(0, 0, 0).Name(), "0/1");
}

// sbatch --array=3 after the third of eight tasks failed: it would do all images, beside those that are at work.
TEST(ShardOptions, TasksThatAreSubmittedAgainAskForTheNumberOfShards) {
  for (const auto& [first, last] : {std::pair{3, 3}, {1, 1}, {2, 5}}) {
    const std::string error = test_support::MessageOf<phi::UsageError>([&] { ShardOfTask(first, first, last); });
    EXPECT_THAT(error, ::testing::HasSubstr("SLURM_ARRAY_TASK_ID: the job array has task"));
    EXPECT_THAT(error, ::testing::HasSubstr("--num_shards"));
  }
  EXPECT_EQ(ShardOfTask(3, 3, 3, 8).Name(), "3/8");
}

}  // namespace
}  // namespace colmap_ext
