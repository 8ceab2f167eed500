// The view policy of estimate_pixel.h on the CPU.
#pragma once

#include <cstdint>

#include <tbb/parallel_for.h>

#include "phi/backend.h"
#include "phi/base/cancellation.h"
#include "phi/cpu/sector_bests.h"
#include "phi/cpu/simd_matcher.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {

// Each row has a copy, which counts alone and knows the row's sectors.
struct CpuContext {
  using Matcher = SimdMatcher;
  using Patch = Matcher::Patch;
  using Ranked = Matcher::Ranked;

  const EstimationParameters& parameters;
  EstimationState state;
  const Matcher& matcher;
  mutable EstimationCounts counts = {};
  SectorBests bests = {};

  bool BestInSector(int x, int, int sector, PixelOffset* best) const {
    return bests.BestInSector(x, sector, best);
  }
  Patch LoadPatch(int x, int y) const { return matcher.LoadPatch(x, y); }
  float Cost(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples samples) const {
    float costs[kMaxSourceViews];
    Count(matcher.Costs(patch, x, y, h, samples, costs), matcher.NumSamplesPerWindow(samples));
    return CombineCosts(costs, parameters.num_views, parameters.view_mean);
  }
  float Rank(const Patch& patch, int x, int y, const PlaneHypothesis& h, Ranked* ranked) const {
    float costs[kMaxSourceViews];
    Count(matcher.Rank(patch, x, y, h, ranked, costs), matcher.NumSamplesPerWindow(Samples::kSparse));
    return CombineCosts(costs, parameters.num_views, parameters.view_mean);
  }
  float Score(const Patch& patch, int, int, const PlaneHypothesis&, Ranked* ranked) const {
    float costs[kMaxSourceViews];
    Count(matcher.Score(patch, ranked, costs),
          matcher.NumSamplesPerWindow(Samples::kAll) - matcher.NumSamplesPerWindow(Samples::kSparse));
    return CombineCosts(costs, parameters.num_views, parameters.view_mean);
  }

 private:
  void Count(int num_windows, int num_samples) const {
    ++counts.hypotheses;
    counts.windows += num_windows;
    counts.samples += static_cast<std::int64_t>(num_windows) * num_samples;
  }
};

template <class Function>
void ForEachRow(int height, const Function& function) {
  tbb::parallel_for(0, height, [&](int y) {
    ThrowIfCancelled();
    function(y);
  });
}

}  // namespace phi
