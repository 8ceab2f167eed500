#include "colmap_ext/pipeline/stage_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/pipeline/stage_plan.h"

namespace colmap_ext {
namespace {

// The key of the only image's result in each stage.
std::vector<std::string> Keys(const std::vector<Stage>& stages) {
  std::vector<ImageJob> jobs(1);
  jobs[0].input_key = "camera, images, points";
  const PlanQueries nothing_done = {.is_done = [](int, int, const std::string&) { return false; },
                                    .has_failed = [](int, int, const std::string&) { return false; }};
  std::vector<std::string> keys;
  for (const StagePlan& stage : MakePlan(stages, jobs, nothing_done)) keys.push_back(stage.keys[0]);
  return keys;
}

// Maps of an earlier program are made again from the first stage on that now makes others.
TEST(StageGraphTest, AnotherRevisionOfAStageChangesItsKeysAndThoseAfterIt) {
  const std::vector<Stage> stages = BuildStages(PipelineOptions());
  const std::vector<std::string> keys = Keys(stages);
  ASSERT_EQ(stages.size(), 5u);  // estimation, sharing, filter, inference, filter
  for (std::size_t changed = 0; changed < stages.size(); ++changed) {
    std::vector<Stage> earlier = stages;
    const std::size_t revision = earlier[changed].options.find("revision=");
    ASSERT_NE(revision, std::string::npos) << earlier[changed].options;
    earlier[changed].options.insert(revision + 9, "1");
    const std::vector<std::string> earlier_keys = Keys(earlier);
    for (std::size_t s = 0; s < stages.size(); ++s) {
      EXPECT_EQ(earlier_keys[s] == keys[s], s < changed) << "stage " << s << ", changed " << changed;
    }
  }
}

TEST(StageGraphTest, NoResultIsIntermediateWithSomeOptionsAndOutputWithOthers) {
  PipelineOptions options;
  for (int choice = 0; choice < 8; ++choice) {
    options.geom_consistency = (choice & 1) != 0;
    options.filter_maps = (choice & 2) != 0;
    options.inference.mode = (choice & 4) != 0 ? phi::InferenceMode::kOff : phi::InferenceMode::kMrf;
    for (const Stage& stage : BuildStages(options)) {
      const bool is_listed =
          std::find(std::begin(kIntermediateKinds), std::end(kIntermediateKinds), stage.result) != std::end(kIntermediateKinds);
      EXPECT_EQ(is_listed, !stage.is_output) << stage.result;
    }
  }
}

// Ten images in a row, each with the one before and the one after as its sources.
std::vector<ImageJob> Row() {
  std::vector<ImageJob> jobs(10);
  for (int j = 0; j < 10; ++j) {
    jobs[j].image = j;
    jobs[j].input_key = "input " + std::to_string(j);
    for (const int source : {j - 1, j + 1}) {
      if (source >= 0 && source < 10) jobs[j].sources.push_back(source);
    }
    jobs[j].source_jobs = jobs[j].sources;
  }
  return jobs;
}

PlanScope Only(int job) {
  PlanScope scope;
  scope.own.assign(10, 0);
  scope.own[job] = 1;
  return scope;
}

// The stages are photometric, shared (intermediate), measured, inferred (intermediate) and geometric, and the last four read the sources'
// maps.
TEST(StageGraphTest, AShardReachesAsFarAsItsStagesRead) {
  const std::vector<Stage> stages = BuildStages(PipelineOptions());
  PlanScope scope = Only(0);
  // Whether 0's inferred map is wanted its reader 1 knows, whose geometric map follows from the inferred ones of 0 to 2, those from
  // the measured ones of 0 to 4, those from the shared ones of 0 to 5, those from the photometric ones of 0 to 6.
  EXPECT_EQ(JobsInReach(stages, Row(), scope), (std::vector<int>{0, 1, 2, 3, 4, 5, 6}));
  PipelineOptions once;
  once.inference.method.rules.Set(phi::Rule::kSecondChoice, 0);
  EXPECT_EQ(JobsInReach(BuildStages(once), Row(), scope), (std::vector<int>{0, 1, 2, 3, 4, 5})) << "of the measured ones 0 to 3";
  scope.end_stage = 3;
  // As above: whether 0's shared map is wanted 1 knows, whose measured map follows from those of 0 to 2.
  EXPECT_EQ(JobsInReach(stages, Row(), scope), (std::vector<int>{0, 1, 2, 3})) << "the measured map alone";
  scope.end_stage = 1;
  EXPECT_EQ(JobsInReach(stages, Row(), scope), (std::vector<int>{0})) << "the photometric map alone";
}

// Other jobs' input keys are not there; what the shard plans must not notice.
TEST(StageGraphTest, AShardsKeysAreThoseOfTheWholeRun) {
  const std::vector<Stage> stages = BuildStages(PipelineOptions());
  const PlanQueries nothing_done = {.is_done = [](int, int, const std::string&) { return false; },
                                    .has_failed = [](int, int, const std::string&) { return false; }};
  const std::vector<StagePlan> whole = MakePlan(stages, Row(), nothing_done);
  for (int own = 0; own < 10; ++own) {
    const PlanScope scope = Only(own);
    std::vector<ImageJob> jobs = Row();
    const std::vector<int> reach = JobsInReach(stages, jobs, scope);
    for (int j = 0; j < 10; ++j) {
      if (std::find(reach.begin(), reach.end(), j) == reach.end()) jobs[j].input_key = "not read";
    }
    const std::vector<StagePlan> plan = MakePlan(stages, jobs, nothing_done, scope);
    for (std::size_t s = 0; s < stages.size(); ++s) EXPECT_EQ(plan[s].keys[own], whole[s].keys[own]) << own << ", " << s;
    EXPECT_EQ(plan[0].pending, std::vector<int>{own});
    ASSERT_EQ(plan[1].waiting.size(), 1u) << "for a neighbour's photometric map";
    EXPECT_EQ(plan[1].waiting[0].job, own);
    EXPECT_EQ(plan[1].waiting[0].input_job, own > 0 ? own - 1 : 1);
    EXPECT_TRUE(plan[1].pending.empty());
  }
}

// Each image's neighbours are matched, and the one two places on is a witness: sharing reads the neighbours' maps, the
// filter all, and what a witness is concerns the filter and those after it alone.
TEST(StageGraphTest, OnlyMatchedSourcesConcernTheEstimates) {
  PipelineOptions options;
  options.geom_consistency = false;  // estimates are no output
  const std::vector<Stage> stages = BuildStages(options);
  ASSERT_EQ(stages.size(), 3u);
  std::vector<ImageJob> jobs = Row();
  for (int j = 1; j < 8; ++j) {
    jobs[j].sources.push_back(j + 2);
    jobs[j].source_jobs.push_back(j + 2);
    jobs[j].max_matched = 2;
  }
  EXPECT_EQ(InputJobs(stages[1], jobs, 4), (std::vector<int>{4, 3, 5}));
  EXPECT_EQ(InputJobs(stages[2], jobs, 4), (std::vector<int>{4, 3, 5, 6}));
  PlanScope scope = Only(4);
  scope.end_stage = 1;
  const std::vector<Stage> without_filter(stages.begin(), stages.begin() + 2);
  EXPECT_EQ(JobsInReach(without_filter, jobs, scope), (std::vector<int>{2, 3, 4, 5, 6})) << "whoever reads 4's estimate";
  const PlanQueries nothing_done = {.is_done = [](int, int, const std::string&) { return false; },
                                    .has_failed = [](int, int, const std::string&) { return false; }};
  const std::vector<StagePlan> before = MakePlan(stages, jobs, nothing_done);
  jobs[4].witness_key = "another camera";
  const std::vector<StagePlan> after = MakePlan(stages, jobs, nothing_done);
  for (std::size_t s = 0; s < stages.size(); ++s) EXPECT_EQ(before[s].keys[4] == after[s].keys[4], s < 2) << s;
  // 4's estimate is there no more. Who still has to share wants it if it matches 4.
  for (const auto& [reader, wants] : {std::pair{3, true}, {5, true}, {2, false}, {7, false}}) {
    const PlanQueries but_one = {.is_done = [r = reader](int stage, int job, const std::string&) { return stage > 0 && job != r; },
                                 .has_failed = [](int, int, const std::string&) { return false; }};
    EXPECT_EQ(!MakePlan(stages, jobs, but_one, Only(4))[0].pending.empty(), wants) << reader;
  }
}

// What a source's regions choose rests on the measured maps of that image's own sources.
TEST(StageGraphTest, InferenceReadsTheMapsAroundItsSources) {
  std::vector<ImageJob> jobs = Row();
  jobs[2].source_jobs[1] = -1;  // 3 makes no map for 2
  const auto inputs = [&](const PipelineOptions& options, int job) { return InputJobs(BuildStages(options)[3], jobs, job); };
  PipelineOptions options;
  EXPECT_EQ(inputs(options, 5), (std::vector<int>{5, 4, 6, 3, 7}));
  EXPECT_EQ(inputs(options, 1), (std::vector<int>{1, 0, 2}));
  EXPECT_EQ(inputs(options, 0), (std::vector<int>{0, 1, 2}));
  const PlanQueries nothing_done = {.is_done = [](int, int, const std::string&) { return false; },
                                    .has_failed = [](int, int, const std::string&) { return false; }};
  // 7 is not read by whoever reads 5's measured map, but by 5's inference.
  const auto key_of_5 = [&] { return MakePlan(BuildStages(options), jobs, nothing_done)[3].keys[5]; };
  const std::string before = key_of_5();
  jobs[9].input_key = "another photo";  // whose estimate 7's measured map rests on, by way of 8
  EXPECT_NE(key_of_5(), before);
  for (const phi::Rule rule : {phi::Rule::kSecondChoice, phi::Rule::kSourceRegions}) {
    PipelineOptions once;
    once.inference.method.rules.Set(rule, 0);
    EXPECT_EQ(inputs(once, 5), (std::vector<int>{5, 4, 6}));
  }
}

// Who asks whether an intermediate map is still wanted knows direct readers alone.
TEST(StageGraphTest, WhatIsReadAroundSourcesIsAnOutput) {
  int num_reading = 0;
  for (const std::vector<Stage>& stages : {BuildStages(PipelineOptions()), BuildFillingStages(PipelineOptions())}) {
    for (std::size_t s = 0; s < stages.size(); ++s) {
      if (!stages[s].reads_maps_around_sources) continue;
      ++num_reading;
      EXPECT_TRUE(s == 0 || stages[s - 1].is_output) << stages[s].result;
    }
  }
  EXPECT_EQ(num_reading, 2);
}

// Images beside it in the row have their geometric maps already, and so need its inferred one no more.
TEST(StageGraphTest, AnIntermediateMapIsWantedByItsReadersOfOtherShards) {
  const std::vector<Stage> stages = BuildStages(PipelineOptions());
  std::vector<int> with_geometric = {0, 1, 2, 3, 4};
  const PlanQueries queries = {
      .is_done =
          [&](int stage, int job, const std::string&) {
            if (stage < 3) return true;
            return stage == 4 && std::find(with_geometric.begin(), with_geometric.end(), job) != with_geometric.end();
          },
      .has_failed = [](int, int, const std::string&) { return false; }};
  EXPECT_EQ(MakePlan(stages, Row(), queries, Only(4))[3].pending, std::vector<int>{4}) << "5 reads it";
  EXPECT_TRUE(MakePlan(stages, Row(), queries, Only(3))[3].pending.empty());
}

}  // namespace
}  // namespace colmap_ext
