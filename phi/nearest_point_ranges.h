// Ranges of the first depths (paper section B).
#pragma once

#include <vector>

#include "phi/base/array2d.h"
#include "phi/matching/depth_ranges.h"
#include "phi/scene_view.h"

namespace phi {

// Depth range of the nearest points, one in each quadrant and none farther than width / 10. One range for
// each cell of kDepthRangeCell x kDepthRangeCell pixels, exact at the cell's centre. Unknown where fewer than
// two points are near: there the view's robust range applies.
using DepthRangeMap = Array2D<DepthRange>;  // element (x / kDepthRangeCell, y / kDepthRangeCell)

// Does not depend on the order of the points.
DepthRangeMap NearestPointDepthRanges(const std::vector<SparseObservation>& points, int width, int height);

}  // namespace phi
