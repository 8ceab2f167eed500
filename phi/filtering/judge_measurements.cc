#include "phi/filtering/judge_measurements.h"

#include <cstddef>

#include "phi/base/whole_array.h"
#include "phi/filtering/confidence.h"
#include "phi/filtering/neighbor_agreement.h"
#include "phi/filtering/own_texture.h"

namespace phi {

void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision, const PlaneMap& estimate,
                       MeasurementMap* map) {
  const RayModel& rays = precision.reference();
  const OwnTexture texture = FindOwnTexture(image, noise);
  const Array2D<float> deviations = precision.RelativeDeviations(estimate);
  Array2D<float> log_odds(map->width(), map->height());
  ForConfidenceTerms({rays, estimate, map->testimonies, deviations, texture.variance, noise},
                     [&](int x, int y, const ConfidenceTerms& terms) { log_odds(x, y) = ConfidenceLogOdds(terms); });
  map->testimonies = {};
  DropPlainPixels(texture, map);
  DropLonelyPixels(rays, deviations, map);
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PixelState& state = map->states.data()[i];
      const bool is_measured = state != PixelState::kNone;
      if (log_odds.data()[i] >= kEvidenceLogOdds && estimate.data()[i].depth > 0) {
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
