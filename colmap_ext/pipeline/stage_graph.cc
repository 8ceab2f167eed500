#include "colmap_ext/pipeline/stage_graph.h"

#include "colmap_ext/workspace.h"

namespace colmap_ext {
namespace {

// A result's key holds the revision of what made it, so that maps of an earlier program are made again where this one
// would make others, and kept where it would not. Raise the one of a stage with every change of the maps that it makes;
// the stages after it follow by their inputs.
constexpr int kEstimateRevision = 16, kShareRevision = 1, kFilterRevision = 18, kInferRevision = 55;
// The same for what changes with formulas paper alone.
constexpr int kPaperRevision = 1;

// Times relative to an estimation, for the first guess of the time left.
constexpr double kShareWeight = 0.15, kFilterWeight = 0.02, kInferWeight = 0.3, kPublishWeight = 0.01;
// The same relative to an inference, where nothing is estimated.
constexpr double kFilterWeightInFilling = 0.1;

std::string RevisionText(int revision, phi::Formulas formulas) {
  std::string text = "revision=" + std::to_string(revision) + " formulas=" + std::to_string(static_cast<int>(formulas));
  if (formulas == phi::Formulas::kPaper) text += "." + std::to_string(kPaperRevision);
  return text;
}

std::string EstimationText(PipelineOptions o) {
  return RevisionText(kEstimateRevision, o.stereo.method.formulas) + o.stereo.List().KeyText() +
         o.EstimationList().KeyText() + " seed=" + std::to_string(o.stereo.seed) +
         " cost=" + std::to_string(o.NeedsCost()) + o.stereo.method.rules.KeyText(phi::RuleStage::kEstimation);
}

std::string FilterText(phi::FilterOptions o) {
  return RevisionText(kFilterRevision, o.method.formulas) + o.List().KeyText() +
         o.method.rules.KeyText(phi::RuleStage::kFilter);
}

std::string InferenceText(phi::InferenceOptions o) {
  return RevisionText(kInferRevision, o.method.formulas) + o.List().KeyText() +
         o.method.rules.KeyText(phi::RuleStage::kInference);
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
  return options.filter.method.formulas == phi::Formulas::kRobust;
}

// What inference corrects of the measured maps, and no view confirms.
bool RestoresMeasured(const PipelineOptions& options) {
  return options.inference.method.FormulasOf(phi::Rule::kEdgeDepths) == phi::Formulas::kRobust;
}

// What a source's regions choose rests on that image's own sources.
bool ReadsAroundSources(const PipelineOptions& options) {
  return options.inference.method.FormulasOf(phi::Rule::kSourceRegions) == phi::Formulas::kRobust &&
         options.inference.method.FormulasOf(phi::Rule::kSecondChoice) == phi::Formulas::kRobust;
}

bool SharesHypotheses(const PipelineOptions& options) {
  return options.filter_maps && options.filter.method.FormulasOf(phi::Rule::kSharedHypotheses) == phi::Formulas::kRobust;
}

Stage MakeShare(const PipelineOptions& options) {
  return {.kind = StageKind::kShare,
          .result = std::string(kShared),
          .options = RevisionText(kShareRevision, options.filter.method.formulas),
          .is_output = false,
          .transient = true,
          .reads_source_maps = true,
          .weight = kShareWeight};
}

Stage MakePublish(std::string_view result) {
  return {.kind = StageKind::kPublish, .result = std::string(result), .weight = kPublishWeight};
}

// Filtered photometric maps take the name of the raw ones, which then are an intermediate result.
bool RawMapsAreOutput(const PipelineOptions& options) {
  return options.geom_consistency || !options.filter_maps;
}

Stage MakeEstimate(const PipelineOptions& options) {
  return {.kind = StageKind::kEstimate,
          .result = EstimateKind(options),
          .options = EstimationText(options),
          .is_output = RawMapsAreOutput(options),
          .is_rounded = true};
}

}  // namespace

std::string ActivityName(StageKind kind) {
  switch (kind) {
    case StageKind::kEstimate:
      return "estimating";
    case StageKind::kShare:
      return "comparing";
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
  return RawMapsAreOutput(options) ? std::string(kPhotometric) : std::string(kRaw);
}

std::vector<Stage> BuildStages(const PipelineOptions& options) {
  std::vector<Stage> stages = {MakeEstimate(options)};
  if (SharesHypotheses(options)) stages.push_back(MakeShare(options));
  if (!options.geom_consistency) {
    if (options.filter_maps) stages.push_back(MakeFilter(kPhotometric, options));
    return stages;
  }
  if (options.filter_maps) {
    stages.push_back(MakeFilter(kMeasured, options));
    stages.back().has_mask = true;
    stages.back().is_rounded = true;
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
                    .reads_maps_around_sources = ReadsAroundSources(options),
                    .weight = kInferWeight});
  stages.push_back(MakeFilter(kGeometric, options));
  stages.back().has_mask = true;
  stages.back().restores_measured = RestoresMeasured(options);
  return stages;
}

std::vector<Stage> BuildFillingStages(const PipelineOptions& options) {
  const Stage measured{.kind = StageKind::kPublish, .result = std::string(kMeasured)};
  Stage geometric{.kind = StageKind::kPublish, .result = std::string(kGeometric), .key_prefix = kFillingKey};
  if (options.inference.mode == phi::InferenceMode::kOff) return {measured, geometric};
  geometric.kind = StageKind::kFilter;
  geometric.has_mask = true;
  geometric.reads_source_maps = true;
  geometric.restores_measured = RestoresMeasured(options);
  geometric.weight = kFilterWeightInFilling;
  return {measured,
          {.kind = StageKind::kInfer,
           .result = std::string(kInferred),
           .is_output = false,
           .transient = true,
           .reads_source_maps = true,
           .reads_maps_around_sources = ReadsAroundSources(options)},
          geometric};
}

}  // namespace colmap_ext
