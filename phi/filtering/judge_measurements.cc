#include "phi/filtering/judge_measurements.h"

#include <cstdint>
#include <utility>

#include "phi/base/whole_array.h"
#include "phi/filtering/confidence.h"
#include "phi/filtering/own_texture.h"

namespace phi {

void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision,
                       const PlaneMap& estimate, MeasurementMap* map, const Rules& rules) {
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
                       if (!(ConfidenceLogOdds(terms) >= clue_log_odds)) return;
                       map->planes(x, y) = estimate(x, y);
                       map->states(x, y) = PixelState::kClue;
                     });
}

}  // namespace phi
