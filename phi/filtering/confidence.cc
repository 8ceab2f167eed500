#include "phi/filtering/confidence.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include "phi/filtering/neighbor_planes.h"

namespace phi {
namespace {

constexpr int kNeighborSpacing = 3;  // pixels: windows that overlap less than the next pixel's
constexpr float kNumNeighbors = 24;

// As scripts/fit_confidence printed them.
constexpr ConfidenceTerms kWeights = {2.716f, 0.124f, 0.273f, 0.261f, 3.113f, -0.361f};
constexpr float kConstant = -4.793f;

}  // namespace

void ForConfidenceTerms(const PlaneMap& estimate, const Array2D<Testimonies>& testimonies, double noise,
                        const DepthPrecision& precision,
                        const std::function<void(int x, int y, const ConfidenceTerms& terms)>& function) {
  ConfidenceTerms of_image = {};
  of_image[kNoise] = static_cast<float>(std::log2(0.02 + noise * noise / 9));
  ForNeighborCounts(
      precision, estimate, kNeighborSpacing, [&](int y, const std::vector<float>& depths, const NeighborCounts& counts) {
        for (int x = 0; x < estimate.width(); ++x) {
          if (!(depths[x] > 0)) continue;
          const Testimonies& t = testimonies(x, y);
          const int telling = t.num_confirming + t.num_contradicting;
          ConfidenceTerms terms = of_image;
          terms[kConfirmingShare] = telling > 0 ? static_cast<float>(t.num_confirming) / static_cast<float>(telling) : 0;
          terms[kConfirming] = std::log2(1.0f + t.num_confirming);
          terms[kContradicting] = std::log2(1.0f + t.num_contradicting);
          terms[kAnyClose] = t.num_close > 0;
          terms[kAgreeingShare] = static_cast<float>(counts.agreeing[x]) / kNumNeighbors;
          function(x, y, terms);
        }
      });
}

float ConfidenceLogOdds(const ConfidenceTerms& terms) {
  float sum = kConstant;
  for (std::size_t i = 0; i < terms.size(); ++i) sum += kWeights[i] * terms[i];
  return sum;
}

}  // namespace phi
