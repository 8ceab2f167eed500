#include "phi/filtering/neighbor_agreement.h"

#include <cstddef>

#include "phi/base/images.h"
#include "phi/base/whole_array.h"
#include "phi/filtering/neighbor_planes.h"

namespace phi {

void DropLonelyPixels(const RayModel& rays, const Array2D<float>& deviations, MeasurementMap* map) {
  Mask is_lonely(map->width(), map->height());
  ForNeighborCounts(rays, map->planes, deviations, 1, [&](int y, const NeighborCounts& counts) {
    for (int x = 0; x < is_lonely.width(); ++x) {
      const int asked = counts.asked[x], agreeing = counts.agreeing[x];
      const bool contradicted = asked >= kMinNeighborsAsked && 100 * agreeing < kMinPercentAgreeing * asked;
      is_lonely(x, y) = contradicted || agreeing < kMinNeighborsAgreeing;
    }
  });
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (is_lonely.data()[i] != 0) map->Drop(i);
    }
  });
}

}  // namespace phi
