#include "phi/filtering/judge_measurements.h"

#include <cstddef>

#include "phi/base/whole_array.h"
#include "phi/filtering/confidence.h"
#include "phi/filtering/own_texture.h"

namespace phi {

void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision,
                       const PlaneMap& estimate, MeasurementMap* map, const Rules& rules) {
  const RayModel& rays = precision.reference();
  const OwnTexture texture = FindOwnTexture(image, noise, rules.Scale(Rule::kOwnTexture));
  const Array2D<float> deviations = precision.RelativeDeviations(estimate);
  Array2D<float> log_odds(map->width(), map->height());
  ForConfidenceTerms({rays, estimate, map->testimonies, deviations, texture.variance, noise},
                     [&](int x, int y, const ConfidenceTerms& terms) { log_odds(x, y) = ConfidenceLogOdds(terms); });
  map->testimonies = {};
  if (rules.IsOn(Rule::kOwnTexture)) DropPlainPixels(texture, map);
  if (!rules.IsOn(Rule::kClues)) return;
  const float clue_log_odds = rules.Factor(Rule::kClues) * kClueLogOdds;
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PixelState& state = map->states.data()[i];
      const PlaneHypothesis& h = estimate.data()[i];
      if (state != PixelState::kNone || !(h.depth > 0) || !(log_odds.data()[i] >= clue_log_odds)) continue;
      map->planes.data()[i] = h;
      state = PixelState::kClue;
    }
  });
}

}  // namespace phi
