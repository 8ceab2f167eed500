#include "phi/filtering/judge_measurements.h"

#include <utility>

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
  const Array2D<float> deviations = precision.RelativeDeviations(estimate);
  const float clue_log_odds = rules.Factor(Rule::kClues) * kClueLogOdds;
  ForConfidenceTerms({precision.reference(), estimate, testimonies, deviations, texture.variance, noise},
                     [&](int x, int y, const ConfidenceTerms& terms) {
                       PixelState& state = map->states(x, y);
                       if (state != PixelState::kNone || !(ConfidenceLogOdds(terms) >= clue_log_odds)) return;
                       map->planes(x, y) = estimate(x, y);
                       state = PixelState::kClue;
                     });
}

}  // namespace phi
