#include "phi/geometry/plane_hypothesis.h"

#include "phi/base/whole_array.h"

namespace phi {

DepthMap DepthsOf(const PlaneMap& map) {
  return Transformed(map, [](const PlaneHypothesis& h) { return h.depth; });
}

}  // namespace phi
