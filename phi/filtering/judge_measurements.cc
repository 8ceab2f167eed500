#include "phi/filtering/judge_measurements.h"

#include <cstddef>

#include "phi/base/whole_array.h"
#include "phi/filtering/confidence.h"
#include "phi/filtering/neighbor_agreement.h"
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
  DropLonelyPixels(rays, deviations, map, rules);
  if (!rules.IsOn(Rule::kProbability)) return;
  const float evidence_log_odds = rules.Factor(Rule::kProbability) * kEvidenceLogOdds;
  const bool has_clues = rules.IsOn(Rule::kClues);
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PixelState& state = map->states.data()[i];
      const bool is_measured = state != PixelState::kNone;
      const bool may_be_evidence = (is_measured || has_clues) && estimate.data()[i].depth > 0;
      if (log_odds.data()[i] >= evidence_log_odds && may_be_evidence) {
        map->planes.data()[i] = estimate.data()[i];
        state = is_measured ? PixelState::kMeasured : PixelState::kClue;
      } else if (is_measured && log_odds.data()[i] >= kPublishedLogOdds) {
        state = PixelState::kUnsure;
      } else {
        map->Drop(i);
      }
    }
  });
}

}  // namespace phi
