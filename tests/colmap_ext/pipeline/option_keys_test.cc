// An option that changes maps changes their keys, or a later run would take old maps for its own.
#include <gtest/gtest.h>

#include <concepts>
#include <string>
#include <utility>
#include <vector>

#include "colmap_ext/cli/stereo_options.h"
#include "colmap_ext/fusion/scene_fusion.h"
#include "colmap_ext/pipeline/backend_choice.h"
#include "colmap_ext/pipeline/pipeline_options.h"
#include "colmap_ext/pipeline/stage_graph.h"

namespace colmap_ext {
namespace {

// Converts to whatever a member is.
struct Anything {
  template <typename T>
  operator T() const;  // NOLINT: implicit is the purpose
};

// The number of members of an aggregate: of the most initialisers that it takes.
template <typename T, typename... Members>
constexpr int CountMembers(Members... members) {
  if constexpr (requires { T{members..., Anything{}}; }) {
    return CountMembers<T>(members..., Anything{});
  } else {
    return sizeof...(Members);
  }
}

std::string KeyOfAllStages(const PipelineOptions& options) {
  std::string text;
  for (const Stage& stage : BuildStages(options)) text += stage.result + ": " + stage.options + "\n";
  return text;
}

// Another value within the option's range.
std::string OtherValue(const phi::Option& option) {
  using Type = phi::Option::Type;
  const std::string text = option.Text();
  switch (option.type()) {
    case Type::kBool:
      return text == "true" ? "false" : "true";
    case Type::kInteger:
      return std::to_string(std::stoi(text) + 1);
    case Type::kNumber:
      return std::to_string(std::stod(text) * 0.75 + 0.01);
    case Type::kChoice:
      return option.choices().back() == text ? option.choices().front() : option.choices().back();
    default:
      return text + "x";
  }
}

TEST(OptionKeys, FollowEveryOptionThatChangesMaps) {
  int num_in_key = 0;
  const phi::OptionList names = PipelineOptions().List();
  for (const phi::Option& entry : names) {
    if (entry.is_for_developers()) continue;
    PipelineOptions options;
    const std::string before = KeyOfAllStages(options);
    phi::OptionList list = options.List();
    phi::Option& option = *list.Find(entry.name());
    option.Assign(OtherValue(option));
    ASSERT_NE(option.Text(), option.default_text()) << option.name();
    ASSERT_EQ(option.Check(), "") << option.name();
    options.SetMethod(options.stereo.method);
    if (!option.in_key()) continue;
    ++num_in_key;
    EXPECT_NE(KeyOfAllStages(options), before) << option.name();
  }
  EXPECT_GT(num_in_key, 15);
}

// A stage's key and those after it follow; what an earlier stage made stays.
TEST(OptionKeys, FollowTheRules) {
  using phi::RuleStage;
  const std::string as_is = KeyOfAllStages({});
  const std::vector<Stage> before = BuildStages({});
  for (std::size_t i = 0; i < phi::kNumRules; ++i) {
    const phi::RuleDescription& rule = phi::kRules[i];
    // The keys hold the source images; fusion has keys of its own.
    if (rule.stage == RuleStage::kSourceViews || rule.stage == RuleStage::kFusion) continue;
    PipelineOptions options;
    options.stereo.method.rules.Set(static_cast<phi::Rule>(i), 0.7f);
    options.SetMethod(options.stereo.method);
    EXPECT_NE(KeyOfAllStages(options), as_is) << rule.name;
    EXPECT_EQ(BuildStages(options)[0].options == before[0].options, rule.stage != RuleStage::kEstimation)
        << rule.name;
  }
}

// Those that are not on the list itself: a seed that every command has, what decides the stages.
TEST(OptionKeys, FollowTheSeedAndTheStages) {
  const PipelineOptions defaults;
  PipelineOptions seed, cost, filter;
  seed.stereo.seed = 1;
  cost.write_cost_maps = true;
  filter.filter_maps = false;
  for (const PipelineOptions& other : {seed, cost, filter}) EXPECT_NE(KeyOfAllStages(other), KeyOfAllStages(defaults));
}

// A member that is not on its struct's list: the number at the right, and a name beside it. Whoever adds a member adds it
// to the list, or here with a reason.
TEST(OptionKeys, EveryMemberIsAnOption) {
  const auto size = [](auto options) { return static_cast<int>(options.List().size()); };
  EXPECT_EQ(CountMembers<phi::ViewSelectionOptions>(),
            size(phi::ViewSelectionOptions()) + 2);  // eps of Eq. 1, method
  EXPECT_EQ(CountMembers<phi::StereoOptions>(), size(phi::StereoOptions()) - 2 + 1 + 1);  // method, which is two options; seed
  EXPECT_EQ(CountMembers<phi::FilterOptions>(), size(phi::FilterOptions()) + 1);  // method
  EXPECT_EQ(CountMembers<phi::InferenceOptions>(),
            size(phi::InferenceOptions()) + 4);  // kappa 1 to 3, method
  EXPECT_EQ(CountMembers<phi::FusionOptions>(), size(phi::FusionOptions()) - 2 + 1 + 1);  // method, which is two options; keeps_terms
  EXPECT_EQ(CountMembers<BackendOptions>(), size(BackendOptions()));
  EXPECT_EQ(CountMembers<WorkspaceOptions>(), size(WorkspaceOptions()));
  PipelineOptions pipeline;
  const std::size_t num_own = pipeline.RunList().size() + pipeline.EstimationList().size();
  EXPECT_EQ(CountMembers<PipelineOptions>(), static_cast<int>(num_own) + 4);  // the stages' structs
  // The rule's struct, the input's with its size from the workspace's options, box, the GPU, scratch folder and the size of parts.
  EXPECT_EQ(CountMembers<SceneFusionOptions>(), size(SceneFusionOptions()) - size(phi::FusionOptions()) - 2 + 6);
}

}  // namespace
}  // namespace colmap_ext
