// Which of a run's results a shard makes.
#pragma once

#include <vector>

#include "colmap_ext/pipeline/pipeline_options.h"
#include "colmap_ext/pipeline/shard.h"
#include "colmap_ext/pipeline/stage_plan.h"

namespace colmap_ext {

// Of a run; of a shard every stage has files, since other processes read its results.
std::vector<Stage> StagesOf(const PipelineOptions& options, const Shard& shard);
// Throws phi::UsageError where there is no such stage.
PlanScope ScopeOf(const std::vector<Stage>& stages, const Shard& shard, int num_jobs);

}  // namespace colmap_ext
