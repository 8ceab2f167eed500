#include "phi/filtering/neighbor_agreement.h"

#include <cstddef>

#include "phi/base/images.h"
#include "phi/base/whole_array.h"
#include "phi/filtering/neighbor_planes.h"

namespace phi {

void DropLonelyPixels(const RayModel& rays, const Array2D<float>& deviations, MeasurementMap* map,
                      const Rules& rules) {
  // Off: no pixel has fewer, and none is asked so much.
  const int min_agreeing = rules.IsOn(Rule::kLonely) ? rules.Count(Rule::kLonely, kMinNeighborsAgreeing) : -1;
  const int min_percent =
      rules.IsOn(Rule::kContradicted) ? rules.Count(Rule::kContradicted, kMinPercentAgreeing) : 0;
  const int min_asked = rules.Count(Rule::kContradicted, kMinNeighborsAsked);
  Mask is_lonely(map->width(), map->height());
  ForNeighborCounts(
      rays, map->planes, deviations, 1,
      [&](int y, const NeighborCounts& counts) {
        for (int x = 0; x < is_lonely.width(); ++x) {
          const int asked = counts.asked[x], agreeing = counts.agreeing[x];
          const bool contradicted = asked >= min_asked && 100 * agreeing < min_percent * asked;
          is_lonely(x, y) = contradicted || agreeing < min_agreeing;
        }
      },
      rules.Scale(Rule::kContradicted));
  ForParts(map->size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (is_lonely.data()[i] != 0) map->Drop(i);
    }
  });
}

}  // namespace phi
