// What the consistency filter does at one pixel. Source maps come in turns, so that no more of them need to be in memory at
// once than fit: between turns a pixel is a count of the views that confirm it.
#pragma once

#include <cstdint>

#include "phi/filtering/consistency.h"

namespace phi {

// The most views that options can ask for: a pixel's count is a byte, and stops at what the pixel needs.
inline constexpr int kMaxRequiredViews = 255;

struct FilterReference {
  RayModel rays;
  ConsistencyThresholds thresholds;
  int min_num_consistent = 0, min_num_consistent_inferred = 0;
  float max_cost = 0;
  ArrayView2D<const PlaneHypothesis> map;
  ArrayView2D<const float> cost = {};           // no data: not tested
  ArrayView2D<const std::uint8_t> filled = {};  // no data: nothing is filled
};

// A source view relative to the reference, and its map.
struct FilterSource {
  RelativeView view;
  ArrayView2D<const PlaneHypothesis> map;
};

struct FilterTurn {
  const FilterSource* sources = nullptr;
  int num_sources = 0;
  bool is_last = true;
};

// `before`: what the turn before returned for the pixel, 0 in the first one. Returns how many views confirm it so far, up
// to as many as it needs; in the last turn 1 where the pixel stays, else 0. Neither how the sources are divided among
// turns nor their order changes that.
PHI_HD std::uint8_t FilterPixel(const FilterReference& f, const FilterTurn& turn, int x, int y,
                                std::uint8_t before) {
  const PlaneHypothesis h = f.map(x, y);
  if (!(h.depth > 0)) return 0;
  const std::uint8_t inferred = f.filled.data != nullptr ? f.filled(x, y) : kMeasuredPixel;
  if (f.cost.data != nullptr && inferred == kMeasuredPixel && f.cost(x, y) > f.max_cost) return 0;
  const int required = RequiredViews(inferred, f.min_num_consistent, f.min_num_consistent_inferred);
  int count = before;
  for (int j = 0; j < turn.num_sources && count < required; ++j) {
    const FilterSource& source = turn.sources[j];
    count += IsConsistent(f.rays, source.view, x + 0.5f, y + 0.5f, h, source.map, f.thresholds);
  }
  return static_cast<std::uint8_t>(turn.is_last ? count >= required : count);
}

}  // namespace phi
