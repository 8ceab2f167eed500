// What one pixel does in the estimation (paper section C): initialise, then per iteration propagate and refine.
//
// `Context` is the view policy of a backend. It provides
//   parameters                     EstimationParameters
//   state                          EstimationState
//   LoadPatch(x, y)                the reference samples, in whatever form the backend keeps them
//   Costs(patch, x, y, h, views, costs)   the cost in [0, kMaxCost] of each source view whose bit in `views` is set,
//                                  geometric guidance included; the other elements of `costs` stay as they are
//   kReusesCosts                   whether a candidate that equals an earlier one takes its costs. Not where the threads
//                                  of a warp wait for each other anyway: hardly ever all of them could skip one
// The pixels of one colour read only the state of the other colour and their own, so all of them may run at once.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/random.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/matching/depth_ranges.h"
#include "phi/matching/initial_hypothesis.h"
#include "phi/matching/propagation.h"
#include "phi/matching/refinement.h"
#include "phi/matching/zncc.h"
#include "phi/options.h"

namespace phi {

// Everything that is the same for all pixels of a reference image. Plain data: passed to kernels by value.
struct EstimationParameters {
  RayModel reference;
  MatchingWindow window;
  RandomKey key;
  float depth_min = 0,
        depth_max = 0;                // range of the first hypotheses without sparse points near, world units
  float nearest = 0, farthest = 0;    // depths outside are no hypotheses; world units
  float inverse_depth_per_pixel = 0;  // change of 1 / z that moves a match by one pixel (median of the views)
  int num_views = 0;
  int num_iterations = 8;                      // of all parts of the estimation
  int first_iteration = 0, end_iteration = 8;  // of this part
  int num_levels = 1;                          // of the image pyramids, see window_level.h
  Formulas formulas = Formulas::kRobust;
  Rules rules = {};

  // near: of the sparse points around the pixel.
  PHI_HD RefinementRange Range(int iteration, DepthRange near) const;
  PHI_HD bool IsInRange(float depth) const { return depth >= nearest && depth <= farthest; }
};

// Per-pixel state of the current hypothesis.
struct EstimationState {
  ArrayView2D<PlaneHypothesis> plane;
  ArrayView2D<float> cost;                    // aggregated
  ArrayView2D<std::uint32_t> selected_views;  // bit j: view j counts at this pixel
  std::uint16_t* view_costs = nullptr;        // [view][pixel], see StoreCost
  std::int64_t view_stride = 0;               // elements of view_costs from one view to the next
  DepthRanges ranges = {};                    // of the sparse points, of the whole image; never written

  PHI_HD std::uint16_t& ViewCost(int view, int x, int y) const {
    return view_costs[view * view_stride + static_cast<std::int64_t>(y) * plane.width + x];
  }
};

// View costs are kept in 16 bits: steps of 3e-5.
PHI_HD std::uint16_t StoreCost(float cost) { return static_cast<std::uint16_t>(cost * 32767.0f + 0.5f); }
PHI_HD float LoadCost(std::uint16_t stored) { return stored * (1.0f / 32767.0f); }

// Robust ranges fall geometrically from the first to the last iteration.
PHI_HD RefinementRange EstimationParameters::Range(int iteration, DepthRange near) const {
  constexpr float kFirstPixels = 16.0f, kLastPixels = 0.2f;
  constexpr float kFirstAngle = 0.8f, kLastAngle = 0.05f;  // radian
  const float t = num_iterations > 1 ? static_cast<float>(iteration) / (num_iterations - 1) : 1.0f;
  const float scale = rules.Scale(Rule::kRefinement);
  RefinementRange range;
  range.formulas = rules.IsOn(Rule::kRefinement) ? formulas : Formulas::kPaper;
  range.depth = (near.max > 0 ? near.max : depth_max) / 4;
  range.inverse_depth =
      inverse_depth_per_pixel * (scale * kFirstPixels) * powf(kLastPixels / kFirstPixels, t);
  range.angle = scale * kFirstAngle * powf(kLastAngle / kFirstAngle, t);
  return range;
}

inline constexpr std::uint32_t kAllViews = ~std::uint32_t{0};

// Draw numbers within an iteration.
inline constexpr std::uint32_t kDrawRefinement = 0;

// The hypothesis of pixel (x + dx, y + dy), moved to (x, y) along its plane. False when it leaves its domain
// there.
PHI_HD bool MoveHypothesis(const EstimationParameters& p, const PlaneHypothesis& from, PixelOffset offset,
                           int x, int y, PlaneHypothesis* moved) {
  const Vec3f ray = p.reference.Ray(x + 0.5f, y + 0.5f);
  moved->normal = from.normal;
  moved->depth =
      PlaneDepthAt(p.reference, from, x + offset.dx + 0.5f, y + offset.dy + 0.5f, x + 0.5f, y + 0.5f);
  return p.IsInRange(moved->depth) && FacesCamera(from.normal, ray);
}

PHI_HD void WriteState(const EstimationState& state, int x, int y, const PlaneHypothesis& hypothesis,
                       float cost, std::uint32_t selected, const float* costs, int num_views) {
  state.plane(x, y) = hypothesis;
  state.cost(x, y) = cost;
  state.selected_views(x, y) = selected;
  for (int j = 0; j < num_views; ++j) state.ViewCost(j, x, y) = StoreCost(costs[j]);
}

// The first hypothesis, in the range of the sparse points around the pixel, or in the view's range where that is
// unknown (too few points).
PHI_HD PlaneHypothesis FirstHypothesis(const EstimationParameters& p, DepthRange near, int x, int y) {
  const bool known = near.min > 0;
  const float lo = Clamp(known ? near.min : p.depth_min, p.nearest, p.farthest);
  const float hi = Clamp(known ? near.max : p.depth_max, p.nearest, p.farthest);
  return InitialHypothesis(p.reference, x, y, lo, hi, p.key,
                           p.rules.IsOn(Rule::kFirstHypotheses) ? p.formulas : Formulas::kPaper);
}

template <int kViews, class Context>
PHI_HD void InitializePixelState(const Context& context, int x, int y, const PlaneHypothesis& hypothesis) {
  const EstimationParameters& p = context.parameters;
  const auto patch = context.LoadPatch(x, y);
  float costs[kViews];
  context.Costs(patch, x, y, hypothesis, kAllViews, costs);
  std::uint32_t selected = 0;
  float cost = BestViewsCost(costs, p.num_views, &selected);
  if (p.formulas == Formulas::kPaper || !p.rules.IsOn(Rule::kJointViews))
    cost = HarmonicMeanCost(costs, p.num_views);
  WriteState(context.state, x, y, hypothesis, cost, selected, costs, p.num_views);
}

// Weights of the views at (x, y) from the candidates' costs and the neighbours' selection; returns the new
// selection.
template <int kViews>
PHI_HD std::uint32_t SelectViews(const EstimationState& state, const EstimationParameters& p, int x, int y,
                                 int iteration, const float (*costs)[kViews], int num_candidates,
                                 float* weights) {
  std::uint32_t masks[4];
  int num_masks = 0;
  const PixelOffset neighbours[4] = {{0, -1}, {-1, 0}, {1, 0}, {0, 1}};
  for (const PixelOffset& o : neighbours) {
    if (state.plane.Contains(x + o.dx, y + o.dy))
      masks[num_masks++] = state.selected_views(x + o.dx, y + o.dy);
  }
  const float tau = GoodCostThreshold(iteration);
  // All constants of the evidence are costs: instead of them the costs are scaled.
  const float inverse_scale = 1 / p.rules.Scale(Rule::kJointViews);
  for (int j = 0; j < p.num_views; ++j) {
    ViewEvidence evidence;
    for (int k = 0; k < num_candidates; ++k) evidence.Add(inverse_scale * costs[k][j], tau);
    weights[j] = evidence.Weight(tau) * NeighbourPrior(masks, num_masks, j);
  }
  return PruneWeights(weights, p.num_views);
}

// The first candidate that is the same plane as `h` at the pixel, up to rounding, or -1. Good planes spread over their
// surroundings, so that several regions often send the same one.
PHI_HD int FindSame(const EstimationParameters& p, const PlaneHypothesis* candidates, int num_candidates,
                    const PlaneHypothesis& h) {
  constexpr float kMaxPixels = 1e-3f, kMaxAngle = 3e-4f;  // shift of a match; radian
  for (int k = 0; k < num_candidates; ++k) {
    const Vec3f turn = candidates[k].normal - h.normal;
    if (fabsf(1.0f / candidates[k].depth - 1.0f / h.depth) < kMaxPixels * p.inverse_depth_per_pixel &&
        Dot(turn, turn) < kMaxAngle * kMaxAngle) {
      return k;
    }
  }
  return -1;
}

// One propagation and refinement of the pixel, for `iteration` counted from 0.
template <int kViews, class Context>
PHI_HD void UpdatePixel(const Context& context, int x, int y, int iteration) {
  const EstimationParameters& p = context.parameters;
  const EstimationState& state = context.state;
  const auto patch = context.LoadPatch(x, y);

  // Candidate 0 is the pixel's own hypothesis.
  float costs[kNumRegions + 1][kViews];
  PlaneHypothesis candidates[kNumRegions + 1];
  int num_candidates = 1;
  candidates[0] = state.plane(x, y);
  for (int j = 0; j < p.num_views; ++j) costs[0][j] = LoadCost(state.ViewCost(j, x, y));
  for (int region = 0; region < kNumRegions; ++region) {
    PixelOffset offset;
    if (!BestInRegion(state.cost, x, y, region, &offset)) continue;
    PlaneHypothesis moved;
    if (!MoveHypothesis(p, state.plane(x + offset.dx, y + offset.dy), offset, x, y, &moved)) continue;
    int same = -1;
    if constexpr (Context::kReusesCosts) same = FindSame(p, candidates, num_candidates, moved);
    if (same >= 0) {
      for (int j = 0; j < p.num_views; ++j) costs[num_candidates][j] = costs[same][j];
    } else {
      context.Costs(patch, x, y, moved, kAllViews, costs[num_candidates]);
    }
    candidates[num_candidates++] = moved;
  }

  float weights[kViews];
  std::uint32_t selected = kAllViews;
  const bool is_joint = p.formulas == Formulas::kRobust && p.rules.IsOn(Rule::kJointViews);
  if (is_joint) {
    selected = SelectViews<kViews>(state, p, x, y, iteration, costs, num_candidates, weights);
  }
  const auto aggregate = [&](const float* c) {
    return is_joint ? WeightedMeanCost(c, weights, p.num_views) : HarmonicMeanCost(c, p.num_views);
  };

  int best = 0;
  float best_cost = aggregate(costs[0]);
  for (int k = 1; k < num_candidates; ++k) {
    const float cost = aggregate(costs[k]);
    if (cost < best_cost) {
      best = k;
      best_cost = cost;
    }
  }
  PlaneHypothesis current = candidates[best];
  const float* current_costs = costs[best];

  // Refinement: (d_new, n_old), (d_old, n_new), (d_new, n_new).
  const std::uint64_t pixel = static_cast<std::uint64_t>(y) * state.plane.width + x;
  const Random4 random = Philox(p.key, pixel, static_cast<std::uint32_t>(iteration), kDrawRefinement);
  const Vec3f ray = p.reference.Ray(x + 0.5f, y + 0.5f);
  // Only the paper's range depends on the pixel.
  const DepthRange near = p.formulas == Formulas::kPaper ? state.ranges.At(x, y) : DepthRange();
  const PlaneHypothesis disturbed =
      DisturbHypothesis(current, p.Range(iteration, near), ray, p.nearest, p.farthest, random);
  const PlaneHypothesis old = current;
  float refined_costs[2][kViews];
  int slot = 0;
  for (int variant = 1; variant <= 3; ++variant) {
    const PlaneHypothesis h = {variant & 2 ? disturbed.normal : old.normal,
                               variant & 1 ? disturbed.depth : old.depth};
    // Views without weight do not decide; they keep the cost of the hypothesis that is being refined.
    for (int j = 0; j < p.num_views; ++j) refined_costs[slot][j] = current_costs[j];
    context.Costs(patch, x, y, h, selected, refined_costs[slot]);
    const float cost = aggregate(refined_costs[slot]);
    if (cost < best_cost) {
      best_cost = cost;
      current = h;
      current_costs = refined_costs[slot];
      slot ^= 1;
    }
  }
  WriteState(state, x, y, current, best_cost, selected, current_costs, p.num_views);
}

}  // namespace phi
