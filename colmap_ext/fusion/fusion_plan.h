// Which maps are read and dropped when while images are fused in their order, so that they fit in a budget and few are read
// twice. All look-ups are known beforehand, so the map whose next use lies furthest ahead can be dropped.
#pragma once

#include <cstdint>
#include <vector>

#include "colmap_ext/fusion/neighbor_graph.h"

namespace colmap_ext {

// Positions as in NeighborGraph.
struct FusionStep {
  int reference = 0;
  std::vector<int> neighbors;   // as in the graph; fewer when not all fit in the budget at once
  std::vector<int> drop;        // before anything else
  std::vector<int> load;        // needed by this step
  std::vector<int> load_ahead;  // for later steps, while this one computes
};

struct FusionPlan {
  std::vector<FusionStep> steps;
  std::int64_t num_loads = 0;
};

// order: of all images or of some. bytes: of each map in memory. The reference and two neighbours must fit, else throws phi::ResourceError.
FusionPlan PlanFusion(const NeighborGraph& graph, const std::vector<int>& order,
                      const std::vector<std::int64_t>& bytes, std::int64_t budget_bytes);

struct MemoryShortage {
  int num_images = 0;             // that are fused with fewer neighbours than the graph's
  std::int64_t bytes_wanted = 0;  // budget with which none would be
};

// Of the plans of all images, in whatever order and in however many parts.
MemoryShortage FindShortage(const NeighborGraph& graph, const std::vector<std::int64_t>& bytes, std::int64_t budget_bytes);

}  // namespace colmap_ext
