#include "phi/filtering/judge_measurements.h"

#include <cstddef>
#include <cstdint>
#include <utility>

#include <tbb/parallel_for.h>

#include "phi/base/whole_array.h"
#include "phi/filtering/confidence.h"
#include "phi/filtering/own_texture.h"

namespace phi {
namespace {

// What lies farther than the search went matches best where it ended: clouds and mountains, by all views alike. So a depth that matching
// cannot tell from that end, by a standard deviation, is none.
struct RangeEnd {
  const DepthPrecision& precision;
  float farthest;

  bool Holds(int x, int y, float depth) const {
    if (2 * depth < farthest) return false;  // a depth with a deviation as large as itself is no estimate
    const float deviation = precision.RelativeDeviation(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, depth);
    return depth * (1 + deviation) >= farthest;
  }
};

void DropAtEnd(const RangeEnd& end, MeasurementMap* map) {
  tbb::parallel_for(0, map->height(), [&](int y) {
    for (int x = 0; x < map->width(); ++x) {
      if (!IsMeasured(map->states(x, y)) || !end.Holds(x, y, map->planes(x, y).depth)) continue;
      map->Drop(static_cast<std::size_t>(y) * static_cast<std::size_t>(map->width()) + static_cast<std::size_t>(x));
    }
  });
}

}  // namespace

void JudgeMeasurements(const GrayImage& image, double noise, const DepthPrecision& precision, float farthest,
                       const PlaneMap& estimate, MeasurementMap* map, const Rules& rules) {
  const RangeEnd end = {precision, farthest};
  DropAtEnd(end, map);
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
                       if (!(ConfidenceLogOdds(terms) >= clue_log_odds) || end.Holds(x, y, estimate(x, y).depth)) return;
                       map->planes(x, y) = estimate(x, y);
                       map->states(x, y) = PixelState::kClue;
                     });
}

}  // namespace phi
