#include "colmap_ext/pipeline/stage_plan.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <span>
#include <utility>

#include "colmap_ext/pipeline/result_key.h"

namespace colmap_ext {
namespace {

// Whether it reads the maps of all sources; else those of the matched ones alone, or none.
bool ReadsWitnesses(const Stage& stage) {
  return stage.reads_source_maps && stage.kind != StageKind::kShare;
}

std::span<const int> SourcesRead(const Stage& stage, const ImageJob& job) {
  if (!stage.reads_source_maps) return {};
  const std::span<const int> all(job.source_jobs);
  return ReadsWitnesses(stage) ? all : all.first(job.NumMatched());
}

// Inference asks no more of them.
std::span<const int> Asked(std::span<const int> sources) {
  return sources.first(std::min<std::size_t>(sources.size(), phi::kMaxSourceViews));
}

// Beside the job's own: whose maps of the stage before this one reads, of its sources first; -1 where no job makes one.
std::vector<int> OtherJobsRead(const Stage& stage, const std::vector<ImageJob>& jobs, int job) {
  const std::span<const int> sources = SourcesRead(stage, jobs[job]);
  std::vector<int> read(sources.begin(), sources.end());
  if (!stage.reads_maps_around_sources) return read;
  std::vector<int> around;
  for (const int source : Asked(sources)) {
    if (source < 0) continue;
    for (const int other : Asked(SourcesRead(stage, jobs[source]))) around.push_back(other);
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  std::vector<int> known = read;
  known.insert(known.end(), {job, -1});
  std::sort(known.begin(), known.end());
  std::set_difference(around.begin(), around.end(), known.begin(), known.end(), std::back_inserter(read));
  return read;
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
    for (const int source : OtherJobsRead(stage, jobs, static_cast<int>(j))) key.Add(source < 0 ? std::string() : previous->keys[source]);
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
    for (const int source : OtherJobsRead(stage, jobs, static_cast<int>(j))) {
      if (source >= 0) (*marked)[source] = 1;
    }
  }
}

// Marks what reads a marked job's map, too.
void MarkReaders(const Stage& stage, const std::vector<ImageJob>& jobs, std::vector<char>* marked) {
  const std::vector<char> before = *marked;
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    const std::span<const int> sources = SourcesRead(stage, jobs[j]);
    if (std::any_of(sources.begin(), sources.end(), [&](int source) { return source >= 0 && before[source] != 0; }))
      (*marked)[j] = 1;
  }
}

}  // namespace

std::vector<int> InputJobs(const Stage& stage, const std::vector<ImageJob>& jobs, int job) {
  std::vector<int> inputs = {job};
  for (const int source : OtherJobsRead(stage, jobs, job)) {
    if (source >= 0) inputs.push_back(source);
  }
  return inputs;
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
