#include "colmap_ext/pipeline/stage_graph.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace colmap_ext {
namespace {

// The key of the only image's result in each stage.
std::vector<std::string> Keys(const std::vector<Stage>& stages) {
  std::vector<ImageJob> jobs(1);
  jobs[0].input_key = "camera, images, points";
  const PlanQueries nothing_done = {.is_done = [](int, int, const std::string&) { return false; },
                                    .has_failed = [](int, int) { return false; }};
  std::vector<std::string> keys;
  for (const StagePlan& stage : MakePlan(stages, jobs, nothing_done)) keys.push_back(stage.keys[0]);
  return keys;
}

// Maps of an earlier program are made again from the first stage on that now makes others.
TEST(StageGraphTest, AnotherRevisionOfAStageChangesItsKeysAndThoseAfterIt) {
  const std::vector<Stage> stages = BuildStages(PipelineOptions());
  const std::vector<std::string> keys = Keys(stages);
  ASSERT_EQ(stages.size(), 4u);  // estimation, filter, inference, filter
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

}  // namespace
}  // namespace colmap_ext
