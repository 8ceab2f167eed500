#include "phi/filtering/judge_measurements.h"

#include <cstddef>
#include <cstdint>
#include <utility>

#include "phi/base/whole_array.h"
#include "phi/filtering/confidence.h"
#include "phi/filtering/own_texture.h"

namespace phi {
namespace {

// Of each pixel that cannot be told from the end of the search, 255. What lies farther than the search went matches best where it ended:
// clouds and mountains, by all views alike. So a depth within a standard deviation of that end is none.
Mask FindAtEnd(const PlaneMap& estimate, const DepthPrecision& precision, float farthest) {
  // A depth with a deviation as large as itself is no estimate.
  Mask at_end = Transformed(
      estimate, [farthest](const PlaneHypothesis& h) { return static_cast<std::uint8_t>(2 * h.depth < farthest ? 0 : 255); });
  if (CountIf(at_end, [](std::uint8_t v) { return v != 0; }) == 0) return at_end;
  const Array2D<float> deviations = precision.RelativeDeviations(estimate, at_end);
  ForParts(at_end.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (estimate.data()[i].depth * (1 + deviations.data()[i]) < farthest) at_end.data()[i] = 0;
    }
  });
  return at_end;
}

}  // namespace

void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision, float farthest,
                       const PlaneMap& estimate, MeasurementMap* map, const Rules& rules) {
  const Mask at_end = FindAtEnd(estimate, precision, farthest);
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (at_end.data()[i] != 0) map->Drop(i);
    }
  });
  const int plain_reach = rules.IsOn(Rule::kPlainPatches) ? rules.Count(Rule::kPlainPatches, kPlainReach) : 0;
  const OwnTexture texture = FindOwnTexture(image, noise, rules.Scale(Rule::kOwnTexture), plain_reach);
  const Array2D<Testimonies> testimonies = std::exchange(map->testimonies, {});
  if (rules.IsOn(Rule::kOwnTexture)) DropPlainPixels(texture, map);
  if (!rules.IsOn(Rule::kClues)) return;
  const Mask unmeasured = Transformed(
      map->states, [](PixelState s) { return static_cast<std::uint8_t>(s == PixelState::kNone ? 255 : 0); });
  const Array2D<float> deviations = precision.RelativeDeviations(estimate, unmeasured);
  const float clue_log_odds = rules.Factor(Rule::kClues) * kClueLogOdds;
  ForConfidenceTerms({precision.reference(), estimate, testimonies, unmeasured, deviations, texture.variance, noise},
                     [&](int x, int y, const ConfidenceTerms& terms) {
                       if (!(ConfidenceLogOdds(terms) >= clue_log_odds) || at_end(x, y) != 0) return;
                       map->planes(x, y) = estimate(x, y);
                       map->states(x, y) = PixelState::kClue;
                     });
}

}  // namespace phi
