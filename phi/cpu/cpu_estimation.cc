#include "phi/cpu/cpu_estimation.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "phi/base/cancellation.h"
#include "phi/cpu/simd_matcher.h"
#include "phi/initialization.h"
#include "phi/matching/estimate_pixel.h"
#include "phi/matching/estimation_setup.h"
#include "phi/matching/geometric_guidance.h"

namespace phi {
namespace {

using Matcher = SimdMatcher;

// The view policy of estimate_pixel.h.
struct CpuContext {
  static constexpr bool kReusesCosts = true;

  const EstimationParameters& parameters;
  EstimationState state;
  const Matcher& matcher;
  const std::vector<RelativeView>& views;
  std::vector<ArrayView2D<const PlaneHypothesis>> source_maps;  // empty: no guidance

  Matcher::Patch LoadPatch(int x, int y) const { return matcher.LoadPatch(x, y); }
  void Costs(const Matcher::Patch& patch, int x, int y, const PlaneHypothesis& h, std::uint32_t wanted,
             float* costs) const {
    matcher.Costs(patch, x, y, h, wanted, costs);
    for (std::size_t j = 0; j < source_maps.size(); ++j) {
      if ((wanted >> j & 1u) == 0) continue;
      const float guidance =
          GuidanceCost(parameters.reference, views[j], source_maps[j], x + 0.5f, y + 0.5f, h.depth);
      costs[j] = std::min(costs[j] + guidance, kMaxCost);
    }
  }
};

// Owns what EstimationState views.
struct StateArrays {
  PlaneMap plane;
  CostMap cost;
  Array2D<std::uint32_t> selected_views;
  std::vector<std::uint16_t> view_costs;

  StateArrays(int width, int height, int num_views)
      : plane(width, height),
        cost(width, height),
        selected_views(width, height),
        view_costs(static_cast<std::size_t>(width) * height * num_views) {}

  EstimationState View() {
    return {plane.view(), cost.view(), selected_views.view(), view_costs.data(), plane.view().size()};
  }
};

template <class Function>
void ForEachRow(int height, const Function& function) {
  tbb::parallel_for(0, height, [&](int y) {
    ThrowIfCancelled();
    function(y);
  });
}

template <int kViews>
void Run(const CpuContext& context, const EstimationInput& input) {
  const EstimationParameters& p = context.parameters;
  const int width = p.reference.width, height = p.reference.height;
  const DepthRangeMap ranges = NearestPointDepthRanges(input.sparse, width, height);
  ForEachRow(height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      PlaneHypothesis h;
      if (input.initial != nullptr && (*input.initial)(x, y).depth > 0) {
        h = (*input.initial)(x, y);
      } else {
        const DepthRange range = ranges(x / kDepthRangeCell, y / kDepthRangeCell);
        h = FirstHypothesis(p, range.min, range.max, x, y);
      }
      InitializePixelState<kViews>(context, x, y, h);
    }
  });
  for (int iteration = p.first_iteration; iteration < p.end_iteration; ++iteration) {
    for (int colour = 0; colour < 2; ++colour) {
      ForEachRow(height, [&](int y) {
        for (int x = (y + colour) & 1; x < width; x += 2) UpdatePixel<kViews>(context, x, y, iteration);
      });
    }
  }
}

}  // namespace

EstimationResult EstimateOnCpu(const EstimationInput& input, const StereoOptions& options) {
  const EstimationParameters parameters = MakeEstimationParameters(input, options);
  const std::vector<RelativeView> views = MakeRelativeViews(input);
  StateArrays arrays(parameters.reference.width, parameters.reference.height, parameters.num_views);
  const Matcher matcher(input, parameters, views);
  CpuContext context{parameters, arrays.View(), matcher, views, {}};
  for (const auto& map : input.source_maps) {
    context.source_maps.push_back(map != nullptr ? map->view() : ArrayView2D<const PlaneHypothesis>{});
  }
  if (parameters.num_views <= 8) {
    Run<8>(context, input);
  } else {
    Run<kMaxSourceViews>(context, input);
  }
  return {std::move(arrays.plane), std::move(arrays.cost)};
}

}  // namespace phi
