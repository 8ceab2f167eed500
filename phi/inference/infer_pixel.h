// What one pixel does in inference (paper section E), the same on the CPU and on a GPU: what it rests on, its hypotheses and their
// costs, the field's node, the choice, and what becomes of it.
//
// `Context` is the view policy of a backend. It provides
//   parameters                     InferenceParameters
//   state                          HypothesisState
//   View(j)                        RelativeView of source view j
//   Depths(j)                      its MeasuredDepthsView
//   LoadPatch(x, y)                the reference's samples around the pixel, in whatever form the backend keeps them
//   Costs(patch, x, y, k, costs)   HypothesisViewCost of hypothesis k in each source view
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/inference/confirmation.h"
#include "phi/inference/hypothesis_cost.h"
#include "phi/inference/line_hypothesis.h"
#include "phi/inference/mrf_potentials.h"
#include "phi/inference/plane_normal.h"
#include "phi/inference/upsample.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/matching/zncc.h"
#include "phi/measurement.h"
#include "phi/options.h"

namespace phi {

// The same for all pixels of a reference image. Plain data: passed to kernels by value.
struct InferenceParameters {
  RayModel reference = {};
  MatchingWindow window = {};
  int num_views = 0;
  Method method = {};
};

// What is known of the pixels before one is chosen. Inverse depths; arrays of the reference's size.
struct HypothesisState {
  ArrayView2D<const float> evidence;  // 0 at holes: all that is no evidence
  HypothesisMaps maps = {};
  ArrayView2D<const std::uint8_t> from_region = {};  // bit k: hypothesis k is a region's plane; no data: none is

  PHI_HD bool IsHole(int x, int y) const { return !(evidence(x, y) > 0); }
  PHI_HD std::uint8_t FromRegion(int x, int y) const {
    return from_region.data != nullptr ? from_region(x, y) : 0;
  }
};

// Inverse depth of what tells of other pixels; 0 elsewhere.
PHI_HD float EvidenceAt(PixelState state, float depth) { return IsMeasured(state) ? 1 / depth : 0.0f; }

// Inverse depth of what lines and planes rest on: clues too, but for the paper's; 0 elsewhere.
PHI_HD float AnchorAt(PixelState state, float depth, Formulas formulas) {
  return formulas == Formulas::kRobust && CarriesPlanes(state) ? 1 / depth : EvidenceAt(state, depth);
}

// Nothing in the image says that what is so bright (a window, a lamp, the sky) is a surface; grey levels.
inline constexpr float kOverexposed = 250;

// The hypotheses of hole (x, y) once its region's planes are known (inverse depth there, 0: none): they take the diagonals'
// places, and an overexposed hole has none. Returns which are a region's planes, bit k: hypothesis k.
PHI_HD std::uint8_t PutRegionPlanes(const float (&planes)[kPlanesPerRegion], float brightness, int x, int y,
                                    const ArrayView2D<float> (&maps)[kNumDirections]) {
  constexpr int kReplaced[kPlanesPerRegion] = {kDescending, kAscending};
  if (brightness > kOverexposed - 0.5f) {
    for (const ArrayView2D<float>& map : maps) map(x, y) = 0;
    return 0;
  }
  std::uint8_t from_region = 0;
  for (int i = 0; i < kPlanesPerRegion; ++i) {
    if (!(planes[i] > 0)) continue;
    maps[kReplaced[i]](x, y) = planes[i];
    from_region |= static_cast<std::uint8_t>(1 << kReplaced[i]);
  }
  return from_region;
}

// Whether any source view measured the pixel's point at inverse depth w.
template <class Context>
PHI_HD bool IsConfirmed(const Context& context, int x, int y, float w) {
  for (int j = 0; j < context.parameters.num_views; ++j) {
    if (Confirms(context.View(j), context.Depths(j), x + 0.5f, y + 0.5f, w)) return true;
  }
  return false;
}

// The pixel's hypotheses and their costs; those of what is no hypothesis mean nothing.
template <class Context>
PHI_HD PixelHypotheses JudgeHypotheses(const Context& context, int x, int y) {
  const InferenceParameters& p = context.parameters;
  PixelHypotheses result;
  for (int k = 0; k < kNumDirections; ++k) {
    if (context.state.maps.inverse_depth[k](x, y) > 0) result.offered |= static_cast<std::uint8_t>(1 << k);
  }
  if (result.offered == 0) return result;
  const auto patch = context.LoadPatch(x, y);
  for (int k = 0; k < kNumDirections; ++k) {
    if (!(result.offered >> k & 1)) continue;
    float costs[kMaxSourceViews];
    context.Costs(patch, x, y, k, costs);
    result.cost[k] = CombineCosts(costs, p.num_views, ViewMean::kHarmonic);
  }
  if (p.method.formulas == Formulas::kRobust) {
    PreferRegionPlanes(context.state.FromRegion(x, y), &result, p.method.rules.Factor(Rule::kRegionsFirst));
  }
  return result;
}

// Without a field: the inverse depth of the hypothesis of lowest cost; 0: the pixel stays as it is.
template <class Context>
PHI_HD float CheapestInverseDepth(const Context& context, int x, int y) {
  if (!context.state.IsHole(x, y)) return 0;
  const int best = JudgeHypotheses(context, x, y).Cheapest();
  return best >= 0 ? context.state.maps.inverse_depth[best](x, y) : 0.0f;
}

// A node of the field before its neighbours are asked.
struct FieldNode {
  PixelHypotheses hypotheses;  // of a hole; of evidence: none
  float unlabelled = 0;  // what the pixel holds while no label is chosen: its evidence or 0
  float inverse_depth[kNumDirections] = {};
  std::int32_t unary[kNumDirections] = {};
};

// Node (i, j) of the field. `evidence`: at the nodes' pixels. Evidence beside a node has one label, so that its edge is part of
// the unary energies.
template <class Context>
PHI_HD FieldNode MakeFieldNode(const Context& context, const PotentialView& potentials,
                               ArrayView2D<const float> evidence, int i, int j) {
  constexpr int kOffsets[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  FieldNode node;
  node.unlabelled = evidence(i, j);
  if (evidence(i, j) > 0) return node;
  const int x = kFieldStride * i, y = kFieldStride * j;
  node.hypotheses = JudgeHypotheses(context, x, y);
  for (int k = 0; k < kNumDirections; ++k) {
    if (!(node.hypotheses.offered >> k & 1)) continue;
    const float w = context.state.maps.inverse_depth[k](x, y);
    std::int32_t energy = UnaryEnergy(potentials, node.hypotheses.cost[k]);
    for (const auto& offset : kOffsets) {
      const int ni = i + offset[0], nj = j + offset[1];
      if (evidence.Contains(ni, nj) && evidence(ni, nj) > 0) {
        energy += PairwiseEnergy(potentials, w, evidence(ni, nj));
      }
    }
    node.inverse_depth[k] = w;
    node.unary[k] = energy;
  }
  return node;
}

// Of the hypothesis that the field chose, at full size; 0: the pixel stays as it is. `chosen`: inverse depths of the nodes.
PHI_HD float UpsampledInverseDepth(const HypothesisState& state, ArrayView2D<const float> chosen,
                                   Formulas formulas, int x, int y) {
  if (!state.IsHole(x, y)) return 0;
  const int k = UpsampleHypothesis(state.maps, chosen, formulas, x, y);
  return k >= 0 ? state.maps.inverse_depth[k](x, y) : 0.0f;
}

// The pixel's state in the new map.
template <class Context>
PHI_HD PixelState StateAfterInference(const Context& context, int x, int y, float inferred) {
  if (!(inferred > 0)) return context.state.IsHole(x, y) ? PixelState::kNone : PixelState::kMeasured;
  const bool asks_views = context.parameters.method.formulas == Formulas::kRobust;
  return !asks_views || IsConfirmed(context, x, y, inferred) ? PixelState::kInferredConfirmed : PixelState::kInferredAlone;
}

// The pixel's plane in the new map. `evidence`: what was measured there, or none; `inferred`: the inverse depth, 0: not inferred;
// `all`: evidence and what was inferred.
PHI_HD PlaneHypothesis ComposedPlane(const InferenceParameters& p, const PlaneHypothesis& evidence, float inferred,
                                     ArrayView2D<const float> all, int x, int y) {
  if (inferred > 0) return {FilledNormal(p.reference, all, x, y, p.method.formulas), 1 / inferred};
  return evidence;
}

}  // namespace phi
