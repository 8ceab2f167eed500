#include "phi/cpu/cpu_estimation.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "phi/base/cancellation.h"
#include "phi/cpu/estimation_work.h"
#include "phi/cpu/region_bests.h"
#include "phi/cpu/simd_matcher.h"
#include "phi/initialization.h"
#include "phi/matching/coarse_hypothesis.h"
#include "phi/matching/coarse_start.h"
#include "phi/matching/estimate_pixel.h"
#include "phi/matching/estimation_setup.h"
#include "phi/matching/geometric_guidance.h"
#include "phi/matching/pyramid.h"

namespace phi {
namespace {

using Matcher = SimdMatcher;

// The view policy of estimate_pixel.h. Each row has a copy, which counts alone and knows the row's regions.
struct CpuContext {
  using Patch = Matcher::Patch;
  using Ranked = Matcher::Ranked;

  const EstimationParameters& parameters;
  EstimationState state;
  const Matcher& matcher;
  const std::vector<RelativeView>& views;
  std::span<const ArrayView2D<const float>> source_depths;  // empty: no guidance
  mutable EstimationCounts counts = {};
  RegionBests bests = {};

  bool BestInRegion(int x, int, int region, PixelOffset* best) const { return bests.BestInRegion(x, region, best); }
  Patch LoadPatch(int x, int y) const { return matcher.LoadPatch(x, y); }
  float Cost(const Patch& patch, int x, int y, const PlaneHypothesis& h, Samples samples) const {
    float costs[kMaxSourceViews];
    Count(matcher.Costs(patch, x, y, h, samples, costs), matcher.NumSamplesPerWindow(samples));
    return CostOfViews(x, y, h, costs);
  }
  float Rank(const Patch& patch, int x, int y, const PlaneHypothesis& h, Ranked* ranked) const {
    float costs[kMaxSourceViews];
    Count(matcher.Rank(patch, x, y, h, ranked, costs), matcher.NumSamplesPerWindow(Samples::kSparse));
    return CostOfViews(x, y, h, costs);
  }
  float Score(const Patch& patch, int x, int y, const PlaneHypothesis& h, Ranked* ranked) const {
    float costs[kMaxSourceViews];
    Count(matcher.Score(patch, x, y, h, ranked, costs),
          matcher.NumSamplesPerWindow(Samples::kAll) - matcher.NumSamplesPerWindow(Samples::kSparse));
    return CostOfViews(x, y, h, costs);
  }

 private:
  void Count(int num_windows, int num_samples) const {
    ++counts.hypotheses;
    counts.windows += num_windows;
    counts.samples += static_cast<std::int64_t>(num_windows) * num_samples;
  }
  // Eq. 5, geometric guidance included.
  float CostOfViews(int x, int y, const PlaneHypothesis& h, float (&costs)[kMaxSourceViews]) const {
    for (std::size_t j = 0; j < source_depths.size(); ++j) {
      const float guidance =
          GuidanceCost(parameters.reference, views[j], source_depths[j], x + 0.5f, y + 0.5f, h.depth);
      costs[j] = std::min(costs[j] + guidance, kMaxCost);
    }
    return HarmonicMeanCost(costs, parameters.num_views);
  }
};

template <class Function>
void ForEachRow(int height, const Function& function) {
  tbb::parallel_for(0, height, [&](int y) {
    ThrowIfCancelled();
    function(y);
  });
}

// Where the first hypotheses come from, in this order where there are several.
struct Start {
  const PlaneMap* earlier = nullptr;  // null, or an estimate of the same image; depth <= 0: none there
  CoarseHypotheses coarse;
  DepthRanges ranges;
};

PlaneHypothesis StartHypothesis(const EstimationParameters& p, const Start& start, int x, int y) {
  if (start.earlier != nullptr && (*start.earlier)(x, y).depth > 0) return (*start.earlier)(x, y);
  PlaneHypothesis h;
  if (start.coarse.map.data != nullptr && HypothesisFromCoarse(p, start.coarse, x, y, &h)) return h;
  return FirstHypothesis(p, start.ranges.At(x, y), x, y);
}

void Run(const CpuContext& context, const Start& start, EstimationWork* work) {
  const EstimationParameters& p = context.parameters;
  const int width = p.reference.width, height = p.reference.height;
  // Backend::MatchingCosts: nobody asks for the rest.
  const bool matches_alone = start.earlier != nullptr && p.first_iteration == p.end_iteration;
  ForEachRow(height, [&](int y) {
    const CpuContext of_row = context;
    for (int x = 0; x < width; ++x) {
      if (matches_alone && !((*start.earlier)(x, y).depth > 0)) continue;
      InitializePixelState(of_row, x, y, StartHypothesis(p, start, x, y));
    }
    work->RowDone(width, EstimationWork::kFirstHypotheses, of_row.counts);
  });
  for (int iteration = p.first_iteration; iteration < p.end_iteration; ++iteration) {
    for (int colour = 0; colour < 2; ++colour) {
      ForEachRow(height, [&](int y) {
        CpuContext of_row = context;
        const int first_x = (y + colour) & 1;
        of_row.bests.Find(context.state.cost, first_x, y);
        for (int x = first_x; x < width; x += 2) UpdatePixel(of_row, x, y, iteration);
        work->RowDone(width, EstimationWork::kHalfPassHypotheses, of_row.counts);
      });
    }
  }
}

// The images that a part at `level` works on.
void ReduceImages(int level, EstimationInput* input) {
  const auto reduce = [level](ViewImage* view) {
    for (int i = 0; i < level; ++i) {
      view->image = std::make_shared<const GrayImage>(HalveImage(*view->image));
    }
  };
  reduce(&input->reference);
  for (ViewImage& source : input->sources) reduce(&source);
}

EstimationResult EstimatePart(const EstimationInput& input, const StereoOptions& options,
                              const Start& start, EstimationWork* work) {
  const EstimationParameters parameters = MakeEstimationParameters(input, options);
  const std::vector<RelativeView> views = MakeRelativeViews(input);
  PlaneMap plane(parameters.reference.width, parameters.reference.height);
  CostMap cost(plane.width(), plane.height());
  Array2D<std::uint8_t> changed(plane.width(), plane.height());
  const Matcher matcher(input, parameters, views);
  std::vector<ArrayView2D<const float>> source_depths;
  for (const auto& depths : input.source_depths) {
    source_depths.push_back(depths != nullptr ? depths->view() : ArrayView2D<const float>{});
  }
  const CpuContext context{parameters, {plane.view(), cost.view(), changed.view(), start.ranges}, matcher, views, source_depths};
  Run(context, start, work);
  return {std::move(plane), std::move(cost), {}};
}

// Of the coarsest part; the cells cover more pixels of a finer one.
DepthRangeMap RangesOf(const EstimationInput& input) {
  const Pinhole& size = input.reference.view->camera.pinhole;
  return NearestPointDepthRanges(input.sparse, size.width, size.height);
}

}  // namespace

EstimationResult EstimateOnCpu(const EstimationInput& input, const StereoOptions& options) {
  const std::vector<EstimationPart> parts = EstimationParts(input, options);
  const Pinhole& size = input.reference.view->camera.pinhole;
  EstimationWork work(parts, size.width, size.height, input.tell_progress);
  const DepthRangeMap ranges = RangesOf(PartInput(input, options, parts.front()).input());
  EstimationResult result;
  int coarser_level = parts.front().level;
  for (const EstimationPart& part : parts) {
    PartInput of_part(input, options, part);
    ReduceImages(part.level, &of_part.input());
    const PlaneMap coarse = std::move(result.map);
    const Start start = {.earlier = input.initial.get(),
                         .coarse = {coarse.view(), coarser_level - part.level},
                         .ranges = {ranges.view(), kDepthRangeCell << (parts.front().level - part.level)}};
    result = EstimatePart(of_part.input(), of_part.options(), start, &work);
    coarser_level = part.level;
  }
  result.counts = work.counts();
  return result;
}

}  // namespace phi
