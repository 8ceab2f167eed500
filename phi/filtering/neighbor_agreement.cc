#include "phi/filtering/neighbor_agreement.h"

#include <cstddef>
#include <vector>

#include "phi/filtering/neighbor_planes.h"

namespace phi {

void DropLonelyPixels(const DepthPrecision& precision, MeasurementMap* map) {
  const PlaneMap planes = map->planes;
  ForNeighborCounts(precision, planes, 1, [&](int y, const std::vector<float>& depths, const NeighborCounts& counts) {
    for (int x = 0; x < planes.width(); ++x) {
      const int asked = counts.asked[x], agreeing = counts.agreeing[x];
      const bool contradicted = asked >= kMinNeighborsAsked && 100 * agreeing < kMinPercentAgreeing * asked;
      if (depths[x] > 0 && (contradicted || agreeing < kMinNeighborsAgreeing))
        map->Drop(static_cast<std::size_t>(y) * planes.width() + x);
    }
  });
}

}  // namespace phi
