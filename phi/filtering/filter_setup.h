// The consistency filter of one reference map against its source maps, on the host.
#pragma once

#include <vector>

#include "phi/backend.h"
#include "phi/filtering/consistency.h"
#include "phi/options.h"

namespace phi {

ConsistencyThresholds MakeConsistencyThresholds(const FilterOptions& options);

// Source views that have a map, relative to the reference.
struct FilterContext {
  FilterContext(const FilterInput& input, const FilterOptions& options);

  // True when the pixel has a depth, enough source views confirm it, and its cost is not too high.
  bool Keeps(int x, int y) const;

  RayModel reference;
  ConsistencyThresholds thresholds;
  int min_num_consistent = 0, min_num_consistent_inferred = 0;
  float max_cost = 0;
  ArrayView2D<const PlaneHypothesis> map;
  ArrayView2D<const float> cost;           // no data: not tested
  ArrayView2D<const std::uint8_t> filled;  // no data: nothing is filled
  std::vector<RelativeView> views;
  std::vector<ArrayView2D<const PlaneHypothesis>> source_maps;
};

}  // namespace phi
