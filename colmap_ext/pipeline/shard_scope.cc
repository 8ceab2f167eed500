#include "colmap_ext/pipeline/shard_scope.h"

#include <algorithm>
#include <string>

#include "phi/base/error.h"

namespace colmap_ext {

std::vector<Stage> StagesOf(const PipelineOptions& options, const Shard& shard) {
  std::vector<Stage> stages = BuildStages(options);
  for (Stage& stage : stages) stage.transient &= shard.IsWhole();
  return stages;
}

PlanScope ScopeOf(const std::vector<Stage>& stages, const Shard& shard, int num_jobs) {
  PlanScope scope;
  if (shard.count > 1) {
    const auto [begin, end] = shard.Range(num_jobs);
    scope.own.assign(static_cast<std::size_t>(num_jobs), 0);
    std::fill(scope.own.begin() + begin, scope.own.begin() + end, 1);
  }
  if (shard.only_stage.empty()) return scope;
  std::string names;
  for (std::size_t s = 0; s < stages.size(); ++s) {
    names += (s > 0 ? ", " : "") + stages[s].result;
    if (stages[s].result != shard.only_stage) continue;
    scope.first_stage = static_cast<int>(s);
    scope.end_stage = scope.first_stage + 1;
    return scope;
  }
  throw phi::UsageError("--stage " + shard.only_stage + ": with these options the stages are " + names);
}

}  // namespace colmap_ext
