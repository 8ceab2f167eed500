// What one pixel does in the estimation (paper section C): initialise, then per iteration propagate and refine.
//
// `Context` is the view policy of a backend. It provides
//   parameters                     EstimationParameters
//   state                          EstimationState
//   BestInSector(x, y, sector, &offset)   propagation.h's, over the state's costs
//   LoadPatch(x, y)                the reference samples, in whatever form the backend keeps them
//   Cost(patch, x, y, h, samples)   of the source views' costs, combined by cost_aggregation.h
//   Ranked, Rank(patch, x, y, h, &ranked), Score(patch, x, y, h, &ranked)   for UpdateByRanking alone: the same by sparse samples, and
//                                  then, for the same hypothesis, by all
// The pixels of one colour read only the state of the other colour and their own, so all of them may run at once.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/random.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/matching/depth_ranges.h"
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
  ViewMean view_mean = ViewMean::kCubic;
  bool ranks = false;                          // by sparse samples what is scored by all
  Method method = {};

  // near: of the sparse points around the pixel.
  PHI_HD RefinementRange Range(int iteration, DepthRange near) const;
  PHI_HD bool IsInRange(float depth) const { return depth >= nearest && depth <= farthest; }
};

// Per-pixel state of the current hypothesis.
struct EstimationState {
  ArrayView2D<PlaneHypothesis> plane;
  ArrayView2D<float> cost;                    // aggregated
  ArrayView2D<std::uint8_t> changed;          // 1: the pixel took another plane when it was last worked on
  DepthRanges ranges = {};                    // of the sparse points, of the whole image; never written
};

// Robust ranges fall geometrically from the first to the last iteration.
PHI_HD RefinementRange EstimationParameters::Range(int iteration, DepthRange near) const {
  constexpr float kFirstPixels = 16.0f, kLastPixels = 0.2f;
  constexpr float kFirstAngle = 0.8f, kLastAngle = 0.05f;  // radian
  const float t = num_iterations > 1 ? static_cast<float>(iteration) / (num_iterations - 1) : 1.0f;
  const float scale = method.rules.Scale(Rule::kRefinement);
  RefinementRange range;
  range.formulas = method.FormulasOf(Rule::kRefinement);
  range.depth = (near.max > 0 ? near.max : depth_max) / 4;
  range.inverse_depth =
      inverse_depth_per_pixel * (scale * kFirstPixels) * powf(kLastPixels / kFirstPixels, t);
  range.angle = scale * kFirstAngle * powf(kLastAngle / kFirstAngle, t);
  return range;
}

// Draw numbers within an iteration.
inline constexpr std::uint32_t kDrawRefinement = 0;

// The hypothesis of image point `at`, moved to pixel (x, y) along its plane. False when it leaves its domain there.
PHI_HD bool MovePlane(const EstimationParameters& p, const PlaneHypothesis& from, ImagePoint at, int x, int y,
                      PlaneHypothesis* moved) {
  const Vec3f ray = p.reference.Ray(x + 0.5f, y + 0.5f);
  moved->normal = from.normal;
  moved->depth = PlaneDepthAt(p.reference, from, at.u, at.v, x + 0.5f, y + 0.5f);
  return p.IsInRange(moved->depth) && FacesCamera(from.normal, ray);
}

// The same of pixel (x + dx, y + dy).
PHI_HD bool MoveHypothesis(const EstimationParameters& p, const PlaneHypothesis& from, PixelOffset offset,
                           int x, int y, PlaneHypothesis* moved) {
  return MovePlane(p, from, {x + offset.dx + 0.5f, y + offset.dy + 0.5f}, x, y, moved);
}

PHI_HD void WriteState(const EstimationState& state, int x, int y, const PlaneHypothesis& hypothesis,
                       float cost) {
  state.plane(x, y) = hypothesis;
  state.cost(x, y) = cost;
  state.changed(x, y) = 1;
}

// `hypothesis`: see first_hypothesis.h.
template <class Context>
PHI_HD void InitializePixelState(const Context& context, int x, int y, const PlaneHypothesis& hypothesis) {
  WriteState(context.state, x, y, hypothesis,
             context.Cost(context.LoadPatch(x, y), x, y, hypothesis, Samples::kAll));
}

// The first candidate that is the same plane as `h` at the pixel, up to rounding, or -1. Good planes spread over their
// surroundings, so that several sectors often send the same one: it takes the costs of the first.
PHI_HD int FindSame(const EstimationParameters& p, const PlaneHypothesis* candidates, int num_candidates,
                    const PlaneHypothesis& h) {
  constexpr float kMaxPixels = 1e-3f, kMaxAngle = 3e-4f;  // shift of a match; radian
  for (int k = 0; k < num_candidates; ++k) {
    const Vec3f turn = candidates[k].normal - h.normal;
    // The difference of inverse depths, without divisions.
    if (fabsf(candidates[k].depth - h.depth) < kMaxPixels * p.inverse_depth_per_pixel * candidates[k].depth * h.depth &&
        Dot(turn, turn) < kMaxAngle * kMaxAngle) {
      return k;
    }
  }
  return -1;
}

// What a pixel may become in an iteration beside what it is: each sector's best hypothesis, moved to the pixel. What has not changed
// since the pixel was last worked on was the best of its sector then too, as costs only fall, and a candidate: that is settled.
struct Candidates {
  std::uint32_t offered = 0;  // bit k: sector k has a new one that is neither the pixel's own plane nor an earlier sector's
  PixelOffset offsets[kNumSectors];
  PlaneHypothesis planes[kNumSectors];
};

template <class Context>
PHI_HD Candidates GatherCandidates(const Context& context, int x, int y, int iteration) {
  const EstimationParameters& p = context.parameters;
  const EstimationState& state = context.state;
  const bool is_first = iteration == p.first_iteration;  // nothing was a candidate before
  Candidates candidates;
  PlaneHypothesis met[kNumSectors + 1];
  met[0] = state.plane(x, y);
  int num_met = 1;
  for (int sector = 0; sector < kNumSectors; ++sector) {
    PixelOffset offset;
    if (!context.BestInSector(x, y, sector, &offset)) continue;
    if (!is_first && state.changed(x + offset.dx, y + offset.dy) == 0) continue;
    PlaneHypothesis moved;
    if (!MoveHypothesis(p, state.plane(x + offset.dx, y + offset.dy), offset, x, y, &moved)) continue;
    if (FindSame(p, met, num_met, moved) < 0) candidates.offered |= 1u << sector;
    candidates.offsets[sector] = offset;
    candidates.planes[sector] = moved;
    met[num_met++] = moved;
  }
  return candidates;
}

inline constexpr float kUnknownCost = -1;

// A hypothesis with its cost of all samples.
struct ScoredHypothesis {
  PlaneHypothesis plane;
  float cost = 0;
  float sparse_cost = kUnknownCost;  // the same of sparse samples
};

// The end of a pixel's turn.
PHI_HD void WriteBetter(const EstimationState& state, int x, int y, const ScoredHypothesis& found) {
  state.changed(x, y) = 0;
  if (found.cost < state.cost(x, y)) WriteState(state, x, y, found.plane, found.cost);
}

// Sparse samples rank the candidates, and so many of them are scored by all samples. With one of them raw depths lose half a
// point. The pixel's own hypothesis needs no ranking: where it is better than these, it stays.
inline constexpr int kNumFinalists = 2;

// The cheapest of those in `left` (bit k: number k), the first one on ties; -1: there is none.
PHI_HD int Cheapest(std::uint32_t left, const float (&costs)[kNumSectors]) {
  int cheapest = -1;
  for (int k = 0; k < kNumSectors; ++k) {
    if ((left >> k & 1u) != 0 && (cheapest < 0 || costs[k] < costs[cheapest])) cheapest = k;
  }
  return cheapest;
}

// Refinement: (d_new, n_old), (d_old, n_new), (d_new, n_new); 0 is the hypothesis itself.
inline constexpr int kNumVariants = 3;
PHI_HD PlaneHypothesis RefinementVariant(const PlaneHypothesis& old, const PlaneHypothesis& disturbed,
                                         int variant) {
  return {variant & 2 ? disturbed.normal : old.normal, variant & 1 ? disturbed.depth : old.depth};
}

PHI_HD PlaneHypothesis Disturbed(const EstimationParameters& p, const EstimationState& state,
                                 const PlaneHypothesis& h, int x, int y, int iteration) {
  const std::uint64_t pixel = static_cast<std::uint64_t>(y) * state.plane.width + x;
  const Random4 random = Philox(p.key, pixel, static_cast<std::uint32_t>(iteration), kDrawRefinement);
  const Vec3f ray = p.reference.Ray(x + 0.5f, y + 0.5f);
  // Only the paper's range depends on the pixel.
  const DepthRange near = p.method.formulas == Formulas::kPaper ? state.ranges.At(x, y) : DepthRange();
  return DisturbHypothesis(h, p.Range(iteration, near), ray, p.nearest, p.farthest, random);
}

// One propagation and refinement of the pixel in which sparse samples rank (kSparseRanking). On a GPU each of its four steps is a kernel.
template <class Context>
PHI_HD void UpdateByRanking(const Context& context, int x, int y, int iteration) {
  const EstimationParameters& p = context.parameters;
  const EstimationState& state = context.state;
  const auto patch = context.LoadPatch(x, y);

  const Candidates candidates = GatherCandidates(context, x, y, iteration);
  float ranks[kNumSectors];
  typename Context::Ranked ranked[kNumSectors];
  for (int k = 0; k < kNumSectors; ++k) {
    if ((candidates.offered >> k & 1u) != 0) ranks[k] = context.Rank(patch, x, y, candidates.planes[k], &ranked[k]);
  }

  ScoredHypothesis current = {state.plane(x, y), state.cost(x, y)};
  std::uint32_t left = candidates.offered;
  for (int i = 0; i < kNumFinalists; ++i) {
    const int k = Cheapest(left, ranks);
    if (k < 0) break;
    left &= ~(1u << k);
    const float cost = context.Score(patch, x, y, candidates.planes[k], &ranked[k]);
    if (cost < current.cost) current = {candidates.planes[k], cost, ranks[k]};
  }

  const PlaneHypothesis disturbed = Disturbed(p, state, current.plane, x, y, iteration);
  typename Context::Ranked tried[2];
  int promising = 0, next = 0;  // the promising one is in the other place
  float lowest = current.sparse_cost;
  for (int variant = lowest < 0 ? 0 : 1; variant <= kNumVariants; ++variant) {
    const PlaneHypothesis h = RefinementVariant(current.plane, disturbed, variant);
    const float cost = context.Rank(patch, x, y, h, &tried[next]);
    if (lowest >= 0 && !(cost < lowest)) continue;
    lowest = cost;
    promising = variant;
    next = 1 - next;
  }

  if (promising > 0) {
    const PlaneHypothesis h = RefinementVariant(current.plane, disturbed, promising);
    const float cost = context.Score(patch, x, y, h, &tried[1 - next]);
    if (cost < current.cost) current = {h, cost};
  }
  WriteBetter(state, x, y, current);
}

// The same where everything is scored by all samples.
template <class Context>
PHI_HD void UpdateByAllSamples(const Context& context, int x, int y, int iteration) {
  const EstimationParameters& p = context.parameters;
  const EstimationState& state = context.state;
  const auto patch = context.LoadPatch(x, y);

  ScoredHypothesis current = {state.plane(x, y), state.cost(x, y)};
  const Candidates candidates = GatherCandidates(context, x, y, iteration);
  for (int k = 0; k < kNumSectors; ++k) {
    if ((candidates.offered >> k & 1u) == 0) continue;
    const float cost = context.Cost(patch, x, y, candidates.planes[k], Samples::kAll);
    if (cost < current.cost) current = {candidates.planes[k], cost};
  }

  // Not all with a test of each: threads of a warp score their variants together.
  const PlaneHypothesis old = current.plane, disturbed = Disturbed(p, state, old, x, y, iteration);
  for (int variant = 1; variant <= kNumVariants; ++variant) {
    const PlaneHypothesis h = RefinementVariant(old, disturbed, variant);
    const float cost = context.Cost(patch, x, y, h, Samples::kAll);
    if (cost < current.cost) current = {h, cost};
  }
  WriteBetter(state, x, y, current);
}

template <class Context>
PHI_HD void UpdatePixel(const Context& context, int x, int y, int iteration) {
  if (context.parameters.ranks) {
    UpdateByRanking(context, x, y, iteration);
  } else {
    UpdateByAllSamples(context, x, y, iteration);
  }
}

}  // namespace phi
