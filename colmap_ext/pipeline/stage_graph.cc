#include "colmap_ext/pipeline/stage_graph.h"

#include <algorithm>
#include <span>
#include <utility>

#include "colmap_ext/pipeline/result_key.h"
#include "colmap_ext/workspace.h"

namespace colmap_ext {
namespace {

// A result's key holds the revision of what made it, so that maps of an earlier program are made again where this one
// would make others, and kept where it would not. Raise the one of a stage with every change of the maps that it makes;
// the stages after it follow by their inputs.
constexpr int kEstimateRevision = 15, kShareRevision = 1, kFilterRevision = 17, kInferRevision = 42;
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

// Or of the matched sources alone.
bool ReadsWitnesses(const Stage& stage) {
  return stage.reads_source_maps && stage.kind != StageKind::kShare;
}

// Of those sources whose maps of the stage before this one reads; -1 where no job makes one.
std::span<const int> SourceJobsRead(const Stage& stage, const ImageJob& job) {
  if (!stage.reads_source_maps) return {};
  const std::span<const int> all(job.source_jobs);
  return ReadsWitnesses(stage) ? all : all.first(job.NumMatched());
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
    if (ReadsWitnesses(stage)) key.Add(jobs[j].witness_key);
    for (const int source : SourceJobsRead(stage, jobs[j])) key.Add(source < 0 ? std::string() : previous->keys[source]);
    plan->keys[j] = std::string(stage.key_prefix) + key.Hex();
  }
}

// A job that has another among its sources, to match or as a witness alone.
struct Reader {
  int job;
  bool is_matched;
};

bool Reads(const Stage& stage, const Reader& reader) {
  return stage.reads_source_maps && (reader.is_matched || ReadsWitnesses(stage));
}

// By job.
std::vector<std::vector<Reader>> FindReaders(const std::vector<ImageJob>& jobs) {
  std::vector<std::vector<Reader>> readers(jobs.size());
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    const std::vector<int>& sources = jobs[j].source_jobs;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      if (sources[i] >= 0) readers[sources[i]].push_back({static_cast<int>(j), i < jobs[j].NumMatched()});
    }
  }
  return readers;
}

class Planner {
 public:
  Planner(const std::vector<Stage>& stages, const std::vector<ImageJob>& jobs, const PlanQueries& queries,
          const PlanScope& scope)
      : stages_(stages),
        jobs_(jobs),
        queries_(queries),
        scope_(scope),
        readers_(FindReaders(jobs)),
        plan_(stages.size()),
        done_(stages.size(), std::vector<Answer>(jobs.size(), Answer::kNotAsked)),
        missing_(done_) {}

  std::vector<StagePlan> Plan() {
    for (int s = 0; s < static_cast<int>(stages_.size()); ++s) {
      ComputeKeys(stages_[s], jobs_, s > 0 ? &plan_[s - 1] : nullptr, &plan_[s]);
      for (int j = 0; j < static_cast<int>(jobs_.size()); ++j) {
        std::string& key = plan_[s].keys[j];
        if (!key.empty() && queries_.has_failed(s, j, key)) key.clear();
      }
    }
    for (int s = 0; s < static_cast<int>(stages_.size()); ++s) {
      for (int j = 0; j < static_cast<int>(jobs_.size()); ++j) {
        if (scope_.Owns(s, j) && IsMissing(s, j)) AddTask(s, j);
      }
    }
    return std::move(plan_);
  }

 private:
  enum class Answer : char { kNotAsked, kNo, kYes };

  template <typename Ask>
  static bool Remember(Answer* answer, const Ask& ask) {
    if (*answer == Answer::kNotAsked) *answer = ask() ? Answer::kYes : Answer::kNo;
    return *answer == Answer::kYes;
  }

  bool IsDone(int stage, int job) {
    return Remember(&done_[stage][job], [&] { return queries_.is_done(stage, job, plan_[stage].keys[job]); });
  }

  // Whether the result is not there and wanted: as output, or by a result that is missing.
  bool IsMissing(int stage, int job) {
    return Remember(&missing_[stage][job], [&] {
      if (plan_[stage].keys[job].empty() || IsDone(stage, job)) return false;
      if (stages_[stage].is_output) return true;
      const int next = stage + 1;
      if (next == static_cast<int>(stages_.size())) return false;
      if (IsMissing(next, job)) return true;
      return std::any_of(readers_[job].begin(), readers_[job].end(), [&](const Reader& reader) {
        return Reads(stages_[next], reader) && IsMissing(next, reader.job);
      });
    });
  }

  void AddTask(int stage, int job) {
    const std::vector<int> inputs = stage > 0 ? InputJobs(stages_[stage], jobs_, job) : std::vector<int>{};
    for (const int input : inputs) {
      const bool is_there = plan_[stage - 1].keys[input].empty() || IsDone(stage - 1, input);
      if (is_there || IsPending(stage - 1, input)) continue;
      plan_[stage].waiting.push_back({job, input});
      return;
    }
    plan_[stage].pending.push_back(job);
  }
  bool IsPending(int stage, int job) const {
    const std::vector<int>& pending = plan_[stage].pending;
    return std::binary_search(pending.begin(), pending.end(), job);
  }

  const std::vector<Stage>& stages_;
  const std::vector<ImageJob>& jobs_;
  const PlanQueries& queries_;
  const PlanScope& scope_;
  const std::vector<std::vector<Reader>> readers_;
  std::vector<StagePlan> plan_;
  std::vector<std::vector<Answer>> done_, missing_;
};

// Marks what the marked jobs read, too.
void MarkInputs(const Stage& stage, const std::vector<ImageJob>& jobs, std::vector<char>* marked) {
  const std::vector<char> before = *marked;
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    if (before[j] == 0) continue;
    for (const int source : SourceJobsRead(stage, jobs[j])) {
      if (source >= 0) (*marked)[source] = 1;
    }
  }
}

// Marks what reads a marked job's map, too.
void MarkReaders(const Stage& stage, const std::vector<ImageJob>& jobs, std::vector<char>* marked) {
  const std::vector<char> before = *marked;
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    const std::span<const int> sources = SourceJobsRead(stage, jobs[j]);
    if (std::any_of(sources.begin(), sources.end(), [&](int source) { return source >= 0 && before[source] != 0; }))
      (*marked)[j] = 1;
  }
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

std::vector<int> InputJobs(const Stage& stage, const std::vector<ImageJob>& jobs, int job) {
  std::vector<int> inputs = {job};
  for (const int source : SourceJobsRead(stage, jobs[job])) {
    if (source >= 0) inputs.push_back(source);
  }
  return inputs;
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
                    .weight = kInferWeight});
  stages.push_back(MakeFilter(kGeometric, options));
  stages.back().has_mask = true;
  return stages;
}

std::vector<Stage> BuildFillingStages(const PipelineOptions& options) {
  const Stage measured{.kind = StageKind::kPublish, .result = std::string(kMeasured)};
  Stage geometric{.kind = StageKind::kPublish, .result = std::string(kGeometric), .key_prefix = kFillingKey};
  if (options.inference.mode == phi::InferenceMode::kOff) return {measured, geometric};
  geometric.kind = StageKind::kFilter;
  geometric.has_mask = true;
  geometric.reads_source_maps = true;
  geometric.weight = kFilterWeightInFilling;
  return {measured,
          {.kind = StageKind::kInfer,
           .result = std::string(kInferred),
           .is_output = false,
           .transient = true,
           .reads_source_maps = true},
          geometric};
}

std::vector<StagePlan> MakePlan(const std::vector<Stage>& stages, const std::vector<ImageJob>& jobs,
                                const PlanQueries& queries, const PlanScope& scope) {
  return Planner(stages, jobs, queries, scope).Plan();
}

bool HasPending(const std::vector<StagePlan>& plan) {
  return std::any_of(plan.begin(), plan.end(), [](const StagePlan& stage) { return !stage.pending.empty(); });
}

std::vector<int> JobsInReach(const std::vector<Stage>& stages, const std::vector<ImageJob>& jobs, const PlanScope& scope) {
  const int num_stages = static_cast<int>(stages.size()), num_jobs = static_cast<int>(jobs.size());
  // By stage: the jobs whose results may be asked for. Whether an intermediate one is wanted its readers know.
  std::vector<std::vector<char>> asked(stages.size(), std::vector<char>(jobs.size(), 0));
  for (int s = 0; s < num_stages; ++s) {
    if (s > 0 && !stages[s - 1].is_output) {
      asked[s] = asked[s - 1];
      MarkReaders(stages[s], jobs, &asked[s]);
    }
    for (int j = 0; j < num_jobs; ++j) {
      if (scope.Owns(s, j)) asked[s][j] = 1;
    }
  }
  std::vector<char> reached(jobs.size(), 0);
  for (int s = num_stages - 1; s >= 0; --s) {
    for (int j = 0; j < num_jobs; ++j) reached[j] |= asked[s][j];
    if (s > 0) MarkInputs(stages[s], jobs, &reached);
  }
  std::vector<int> in_reach;
  for (int j = 0; j < num_jobs; ++j) {
    if (reached[j] != 0) in_reach.push_back(j);
  }
  return in_reach;
}

}  // namespace colmap_ext
