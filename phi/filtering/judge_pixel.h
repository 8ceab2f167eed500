// What judging does at one pixel (judge_measurements.h). A GPU runs this; the processor does the same in loops over whole maps, which
// become vector instructions.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/filtering/confidence_terms.h"
#include "phi/filtering/filter_pixel.h"
#include "phi/filtering/own_texture.h"
#include "phi/geometry/match_motion.h"
#include "phi/measurement.h"

namespace phi {

struct JudgementReference {
  RayModel rays;
  const RelativeView* sources = nullptr;  // of DepthPrecision
  int num_sources = 0;
  ArrayView2D<const PlaneHypothesis> estimate;
  ArrayView2D<const std::uint16_t> sums;       // SumBoxes3x3 of the photo
  ArrayView2D<const std::uint8_t> is_plain;    // not 0: IsPlain; no data: not asked
  float farthest = 0;                          // depth at which the search ended, world units
  float least_variance = 0;                    // LeastOwnVariance
  int plain_reach = 0;                         // pixels
  float smoothed_noise = 0;                    // SmoothedNoise
  bool finds_clues = true;
  float clue_log_odds = kClueLogOdds;
};

// Whether a depth cannot be told from the end of the search: what lies farther than the search went matches best where it ended, clouds
// and mountains by all views alike. So a depth within a standard deviation of that end is none. A depth with a deviation as large as
// itself is no estimate.
PHI_HD bool MayBeAtEnd(float depth, float farthest) { return !(2 * depth < farthest); }
PHI_HD bool IsAtEnd(float depth, float deviation, float farthest) {
  return MayBeAtEnd(depth, farthest) && !(depth * (1 + deviation) < farthest);
}

PHI_HD bool IsPlain(const JudgementReference& j, int x, int y) {
  return HasSurroundings(j.sums.width, j.sums.height) && OwnVarianceAt(j.sums, x, y) < j.least_variance;
}

// Whether any pixel up to `plain_reach` away is plain.
PHI_HD bool TouchesPlain(const JudgementReference& j, int x, int y) {
  for (int v = y - j.plain_reach; v <= y + j.plain_reach; ++v) {
    for (int u = x - j.plain_reach; u <= x + j.plain_reach; ++u) {
      if (j.is_plain.Contains(u, v) && j.is_plain(u, v) != 0) return true;
    }
  }
  return false;
}

// `verdict`: of the filter, by all views' testimonies.
PHI_HD PixelState JudgePixel(const JudgementReference& j, int x, int y, const Testimonies& testimonies, FilterVerdict verdict) {
  const PlaneHypothesis h = j.estimate(x, y);
  const bool is_measured = verdict == FilterVerdict::kKept && !(j.is_plain.data != nullptr && TouchesPlain(j, x, y));
  if (!(h.depth > 0) || !(is_measured || j.finds_clues)) return PixelState::kNone;
  if (is_measured && !MayBeAtEnd(h.depth, j.farthest)) return PixelState::kMeasured;
  const float deviation = MatchDeviationOf(j.sources, j.num_sources, x + 0.5f, y + 0.5f, h.depth);
  if (IsAtEnd(h.depth, deviation, j.farthest)) return PixelState::kNone;
  if (is_measured) return PixelState::kMeasured;
  const int num_agreeing = CountAgreeingAround(j.rays, j.estimate, x, y, kConfidenceSpacing, deviation);
  const ConfidenceEvidence evidence = {testimonies, num_agreeing, OwnVarianceAt(j.sums, x, y), j.smoothed_noise, deviation};
  const ConfidenceTerms terms = MakeConfidenceTerms(evidence, h.normal, j.rays.Ray(x + 0.5f, y + 0.5f));
  return ConfidenceLogOdds(terms) >= j.clue_log_odds ? PixelState::kClue : PixelState::kNone;
}

}  // namespace phi
