#include "colmap_ext/pipeline/stage_graph.h"

#include "colmap_ext/pipeline/result_key.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {
namespace {

// A result's key holds the revision of what made it, so that maps of an earlier program are made again where this one
// would make others, and kept where it would not. Raise the one of a stage with every change of the maps that it makes;
// the stages after it follow by their inputs.
constexpr int kEstimateRevision = 5, kFilterRevision = 10, kInferRevision = 16;
// The same for what changes with formulas paper alone.
constexpr int kPaperRevision = 1;

// Times relative to an estimation, for the first guess of the time left.
constexpr double kFilterWeight = 0.02, kInferWeight = 0.3, kPublishWeight = 0.01;
// The same relative to an inference, where nothing is estimated.
constexpr double kFilterWeightInFilling = 0.1;

std::string RevisionText(int revision, phi::Formulas formulas) {
  std::string text = "revision=" + std::to_string(revision) + " formulas=" + std::to_string(static_cast<int>(formulas));
  if (formulas == phi::Formulas::kPaper) text += "." + std::to_string(kPaperRevision);
  return text;
}

std::string EstimationText(PipelineOptions o) {
  return RevisionText(kEstimateRevision, o.stereo.formulas) + o.stereo.List().KeyText() +
         o.EstimationList().KeyText() + " seed=" + std::to_string(o.stereo.seed) +
         " cost=" + std::to_string(o.NeedsCost());
}

std::string FilterText(phi::FilterOptions o) {
  return RevisionText(kFilterRevision, o.formulas) + o.List().KeyText();
}

std::string InferenceText(phi::InferenceOptions o) {
  return RevisionText(kInferRevision, o.formulas) + o.List().KeyText();
}

Stage MakeFilter(std::string_view result, const PipelineOptions& options) {
  return {.kind = StageKind::kFilter,
          .result = std::string(result),
          .options = FilterText(options.filter),
          .reads_source_maps = true,
          .weight = kFilterWeight};
}

// Whatever the inference: measured means one thing. The paper's form knows no such rule.
bool JudgesMeasurements(const PipelineOptions& options) {
  return options.filter.formulas == phi::Formulas::kRobust;
}

Stage MakePublish(std::string_view result) {
  return {.kind = StageKind::kPublish, .result = std::string(result), .weight = kPublishWeight};
}

// Filtered photometric maps take the name of the raw ones, which then are an intermediate result.
bool RawMapsAreOutput(const PipelineOptions& options) {
  return options.geom_consistency || !options.filter_maps;
}

void AppendEstimates(const PipelineOptions& options, std::vector<Stage>* stages) {
  const bool raw_is_output = RawMapsAreOutput(options);
  const int num_guided = options.NumGuidedPasses();
  for (int pass = 0; pass <= num_guided; ++pass) {
    const bool last = pass == num_guided;
    const int first_part = options.stereo.num_iterations - num_guided;  // iterations of the first estimation
    Stage stage{.kind = StageKind::kEstimate, .options = EstimationText(options)};
    stage.first_iteration = pass == 0 ? 0 : first_part + pass - 1;
    stage.end_iteration = first_part + pass;
    stage.weight =
        static_cast<double>(stage.end_iteration - stage.first_iteration) / options.stereo.num_iterations;
    // The first maps are kept for a later run to go on from; those between are cheap to make again.
    stage.transient = pass > 0 && !last;
    stage.result = last ? EstimateKind(options) : "pass" + std::to_string(pass);
    stage.is_output = last && raw_is_output;
    stage.reads_source_maps = pass > 0;
    stages->push_back(stage);
  }
}

void ComputeKeys(const Stage& stage, const std::vector<ImageJob>& jobs, const StagePlan* previous,
                 StagePlan* plan) {
  plan->keys.resize(jobs.size());
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    const bool available = previous ? !previous->keys[j].empty() : jobs[j].problem.empty();
    if (!available) continue;
    ResultKey key;
    key.Add(stage.result).Add(stage.options).Add(jobs[j].input_key);
    if (previous) key.Add(previous->keys[j]);
    if (stage.reads_source_maps) {
      for (const int source : jobs[j].source_jobs)
        key.Add(source < 0 ? std::string() : previous->keys[source]);
    }
    plan->keys[j] = key.Hex();
  }
}

// Marks what the pending tasks of a stage read from the stage before.
void MarkInputs(const Stage& stage, const std::vector<ImageJob>& jobs, const std::vector<int>& pending,
                std::vector<char>* wanted) {
  for (const int j : pending) {
    (*wanted)[j] = 1;
    if (!stage.reads_source_maps) continue;
    for (const int source : jobs[j].source_jobs) {
      if (source >= 0) (*wanted)[source] = 1;
    }
  }
}

}  // namespace

std::string ActivityName(StageKind kind) {
  switch (kind) {
    case StageKind::kEstimate:
      return "estimating";
    case StageKind::kFilter:
      return "filtering";
    case StageKind::kInfer:
      return "filling holes";
    case StageKind::kPublish:
      return "writing";
  }
  return "";
}

std::string EstimateKind(const PipelineOptions& options) {
  return RawMapsAreOutput(options) ? std::string(kPhotometric) : "raw";
}

std::vector<Stage> BuildStages(const PipelineOptions& options) {
  std::vector<Stage> stages;
  AppendEstimates(options, &stages);
  if (!options.geom_consistency) {
    if (options.filter_maps) stages.push_back(MakeFilter(kPhotometric, options));
    return stages;
  }
  if (options.filter_maps) {
    stages.push_back(MakeFilter(kMeasured, options));
    stages.back().has_mask = true;
    stages.back().judges_measurements = JudgesMeasurements(options);
    if (stages.back().judges_measurements) stages.back().options += " judged=1";
  }
  // Without a filter there are no holes to fill; without inference the measured maps are the result.
  if (!options.filter_maps || options.inference.mode == phi::InferenceMode::kOff) {
    stages.push_back(MakePublish(kGeometric));
    return stages;
  }
  stages.push_back({.kind = StageKind::kInfer,
                    .result = std::string(kInferred),
                    .options = InferenceText(options.inference),
                    .is_output = false,
                    .transient = true,
                    .has_mask = true,
                    .reads_source_maps = true,
                    .weight = kInferWeight});
  stages.push_back(MakeFilter(kGeometric, options));
  stages.back().has_mask = true;
  return stages;
}

std::vector<Stage> BuildFillingStages(const PipelineOptions& options) {
  const Stage measured{.kind = StageKind::kPublish, .result = std::string(kMeasured)};
  Stage geometric{.kind = StageKind::kPublish, .result = std::string(kGeometric)};
  if (options.inference.mode == phi::InferenceMode::kOff) return {measured, geometric};
  geometric.kind = StageKind::kFilter;
  geometric.has_mask = true;
  geometric.weight = kFilterWeightInFilling;
  return {measured,
          {.kind = StageKind::kInfer, .result = std::string(kInferred), .is_output = false, .transient = true},
          geometric};
}

std::vector<StagePlan> MakePlan(const std::vector<Stage>& stages, const std::vector<ImageJob>& jobs,
                                const PlanQueries& queries) {
  const int num_stages = static_cast<int>(stages.size()), num_jobs = static_cast<int>(jobs.size());
  std::vector<StagePlan> plan(stages.size());
  for (int s = 0; s < num_stages; ++s) {
    ComputeKeys(stages[s], jobs, s > 0 ? &plan[s - 1] : nullptr, &plan[s]);
    for (int j = 0; j < num_jobs; ++j) {
      if (queries.has_failed(s, j)) plan[s].keys[j].clear();
    }
  }
  std::vector<char> wanted(jobs.size(), 0);
  for (int s = num_stages - 1; s >= 0; --s) {
    for (int j = 0; j < num_jobs; ++j) {
      const std::string& key = plan[s].keys[j];
      if ((wanted[j] || stages[s].is_output) && !key.empty() && !queries.is_done(s, j, key)) {
        plan[s].pending.push_back(j);
      }
    }
    wanted.assign(jobs.size(), 0);
    MarkInputs(stages[s], jobs, plan[s].pending, &wanted);
  }
  return plan;
}

}  // namespace colmap_ext
