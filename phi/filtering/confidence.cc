#include "phi/filtering/confidence.h"

#include <cstdint>
#include <vector>

#include "phi/filtering/neighbor_planes.h"

namespace phi {

void ForConfidenceTerms(const ConfidenceInput& input,
                        const std::function<void(int x, int y, const ConfidenceTerms& terms)>& function) {
  const float smoothed_noise = SmoothedNoise(input.noise);
  ForNeighborCounts(
      input.rays, input.estimate, input.wanted, input.deviations, kConfidenceSpacing,
      [&](int y, const std::vector<std::int32_t>& num_agreeing) {
        for (int x = 0; x < input.estimate.width(); ++x) {
          const PlaneHypothesis& h = input.estimate(x, y);
          if (input.wanted(x, y) == 0 || !(h.depth > 0)) continue;
          const ConfidenceEvidence evidence = {input.testimonies(x, y), num_agreeing[x], input.own_variance(x, y), smoothed_noise,
                                               input.deviations(x, y)};
          function(x, y, MakeConfidenceTerms(evidence, h.normal, input.rays.Ray(x + 0.5f, y + 0.5f)));
        }
      });
}

}  // namespace phi
