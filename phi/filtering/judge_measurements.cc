#include "phi/filtering/judge_measurements.h"

#include <cstddef>
#include <cstdint>

#include "phi/base/whole_array.h"
#include "phi/filtering/confidence.h"
#include "phi/filtering/own_texture.h"

namespace phi {
namespace {

// Of each pixel that cannot be told from the end of the search, 255.
Mask FindAtEnd(const PlaneMap& estimate, const DepthPrecision& precision, float farthest) {
  Mask at_end = Transformed(
      estimate, [farthest](const PlaneHypothesis& h) { return static_cast<std::uint8_t>(MayBeAtEnd(h.depth, farthest) ? 255 : 0); });
  if (CountIf(at_end, [](std::uint8_t v) { return v != 0; }) == 0) return at_end;
  const Array2D<float> deviations = precision.RelativeDeviations(estimate, at_end);
  ForParts(at_end.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!IsAtEnd(estimate.data()[i].depth, deviations.data()[i], farthest)) at_end.data()[i] = 0;
    }
  });
  return at_end;
}

}  // namespace

JudgementReference MakeJudgementReference(const Judgement& judgement) {
  const Rules& rules = judgement.rules;
  JudgementReference j;
  j.rays = judgement.precision.reference();
  j.num_sources = static_cast<int>(judgement.precision.sources().size());
  j.farthest = judgement.farthest;
  j.least_variance = LeastOwnVariance(judgement.noise, rules.Scale(Rule::kOwnTexture));
  j.plain_reach = rules.IsOn(Rule::kPlainPatches) ? rules.Count(Rule::kPlainPatches, kPlainReach) : 0;
  j.smoothed_noise = SmoothedNoise(judgement.noise);
  j.finds_clues = rules.IsOn(Rule::kClues);
  j.clue_log_odds = rules.Factor(Rule::kClues) * kClueLogOdds;
  return j;
}

void JudgeMeasurements(const Judgement& judgement, const PlaneMap& estimate, const Array2D<Testimonies>& testimonies, MeasurementMap* map) {
  const auto& [image, noise, precision, farthest, rules] = judgement;
  const JudgementReference j = MakeJudgementReference(judgement);
  const Mask at_end = FindAtEnd(estimate, precision, farthest);
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (at_end.data()[i] != 0) map->Drop(i);
    }
  });
  const OwnTexture texture = FindOwnTexture(*image, noise, rules.Scale(Rule::kOwnTexture), j.plain_reach);
  if (rules.IsOn(Rule::kOwnTexture)) DropPlainPixels(texture, map);
  if (!j.finds_clues) return;
  const Mask unmeasured = Transformed(
      map->states, [](PixelState s) { return static_cast<std::uint8_t>(s == PixelState::kNone ? 255 : 0); });
  const Array2D<float> deviations = precision.RelativeDeviations(estimate, unmeasured);
  ForConfidenceTerms({j.rays, estimate, testimonies, unmeasured, deviations, texture.variance, noise},
                     [&](int x, int y, const ConfidenceTerms& terms) {
                       if (!(ConfidenceLogOdds(terms) >= j.clue_log_odds) || at_end(x, y) != 0) return;
                       map->planes(x, y) = estimate(x, y);
                       map->states(x, y) = PixelState::kClue;
                     });
}

}  // namespace phi
