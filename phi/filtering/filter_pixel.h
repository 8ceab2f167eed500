// What the consistency filter does at one pixel. Source maps come in turns, so that no more of them need to be in memory at
// once than fit: between turns of them the testimonies are kept.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/filtering/consistency.h"
#include "phi/measurement.h"
#include "phi/options.h"

namespace phi {

// What the filter decides.
enum class FilterVerdict : std::uint8_t { kDropped = 0, kKept = 1 };

struct FilterReference {
  RayModel rays;
  ConsistencyThresholds thresholds;
  // In place of the thresholds' own: a plane through what was measured around a hole tells a depth to a share of it, where a match is good
  // to a pixel.
  float max_reprojection_error_inferred = 0;
  int min_num_consistent = 0, min_num_consistent_inferred = 0;
  // Of an inferred pixel: so many views that find nothing there for each that carries it drop it. 0: any number may.
  float max_empty_ratio = 0;
  float max_cost = 0;
  bool accepts_few_views = true;  // Testimonies::num_close may take the place of views that cannot see the pixel
  ArrayView2D<const PlaneHypothesis> map;
  ArrayView2D<const float> cost = {};         // no data: not tested
  ArrayView2D<const PixelState> states = {};  // no data: estimates, which are judged for the first time
};

struct FilterTurn {
  const FilterSource* sources = nullptr;
  int num_sources = 0;
};

// Whether the pixel was inferred. Others are judged as measurements.
PHI_HD bool WasInferred(const FilterReference& f, int x, int y) {
  return f.states.data != nullptr && IsInferred(f.states(x, y));
}

// Measured pixels were judged before inference. To ask again for views that were dropped or filled since loses right ones.
PHI_HD bool WasJudged(const FilterReference& f, int x, int y) {
  return f.thresholds.formulas == Formulas::kRobust && f.states.data != nullptr && !WasInferred(f, x, y);
}

// Views that must confirm a pixel.
PHI_HD int RequiredViews(const FilterReference& f, bool was_inferred) {
  return was_inferred ? f.min_num_consistent_inferred : f.min_num_consistent;
}

// Whether all sources are asked: the confidence of an estimate rests on all that they say, and so does whether an inferred pixel is there
// at all. Else as many as are required.
PHI_HD bool CountsAll(const FilterReference& f, bool was_inferred) {
  const bool matters = f.states.data == nullptr || (was_inferred && f.max_empty_ratio > 0);
  return matters && f.thresholds.formulas == Formulas::kRobust;
}

// Whether too many of the views that look there find nothing. A wall that is there is there for most that see it; the sky beside it is
// filled where a few views err together.
PHI_HD bool IsEmptyForMost(const FilterReference& f, const Testimonies& t) {
  const int num_carrying = 1 + t.num_confirming;  // with the reference itself
  return f.max_empty_ratio > 0 && static_cast<float>(t.num_empty) >= f.max_empty_ratio * static_cast<float>(num_carrying);
}

inline constexpr int kMostTestimonies = 255;  // of a kind that are counted

PHI_HD void Count(Testimony testimony, Testimonies* t) {
  switch (testimony) {
    case Testimony::kNone:
      break;
    case Testimony::kFindsNothing:
      if (t->num_empty < kMostTestimonies) ++t->num_empty;
      [[fallthrough]];
    case Testimony::kContradicts:
      if (t->num_contradicting < kMostTestimonies) ++t->num_contradicting;
      break;
    case Testimony::kConfirmsClosely:
      ++t->num_close;
      [[fallthrough]];
    case Testimony::kConfirms:
      ++t->num_confirming;
      break;
  }
}

// Whether another source is asked of the pixel, after those that are in `t`.
PHI_HD bool AsksOn(const FilterReference& f, int x, int y, const Testimonies& t) {
  if (!(f.map(x, y).depth > 0) || WasJudged(f, x, y)) return false;
  const bool was_inferred = WasInferred(f, x, y);
  return t.num_confirming < (CountsAll(f, was_inferred) ? kMostTestimonies : RequiredViews(f, was_inferred));
}

PHI_HD float MaxReprojectionError(const FilterReference& f, int x, int y) {
  return WasInferred(f, x, y) ? f.max_reprojection_error_inferred : f.thresholds.max_reprojection_error;
}

// Asks the turn's sources. Neither how the sources are divided among turns nor their order changes the verdict.
PHI_HD void AskSources(const FilterReference& f, const FilterTurn& turn, int x, int y, Testimonies* t) {
  ConsistencyThresholds thresholds = f.thresholds;
  thresholds.max_reprojection_error = MaxReprojectionError(f, x, y);
  for (int j = 0; j < turn.num_sources && AsksOn(f, x, y, *t); ++j) {
    Count(Ask(f.rays, {x + 0.5f, y + 0.5f}, f.map(x, y), turn.sources[j], thresholds), t);
  }
}

// After the last turn.
PHI_HD FilterVerdict JudgeByViews(const FilterReference& f, int x, int y, const Testimonies& t) {
  if (!(f.map(x, y).depth > 0)) return FilterVerdict::kDropped;
  if (WasJudged(f, x, y)) return FilterVerdict::kKept;
  const bool was_inferred = WasInferred(f, x, y);
  if (f.cost.data != nullptr && !was_inferred && f.cost(x, y) > f.max_cost)
    return FilterVerdict::kDropped;
  if (was_inferred && IsEmptyForMost(f, t)) return FilterVerdict::kDropped;
  if (t.num_confirming >= RequiredViews(f, was_inferred))
    return FilterVerdict::kKept;
  // Fewer views than were asked for can see the pixel; all that can confirm it, one of them closely.
  const bool all_confirm = t.num_contradicting == 0 && t.num_close > 0;
  const bool can_be_few = f.accepts_few_views && !was_inferred;
  return can_be_few && all_confirm ? FilterVerdict::kKept : FilterVerdict::kDropped;
}

}  // namespace phi
