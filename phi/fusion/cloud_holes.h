// Holes of the cloud as an image sees them. There a point on weaker evidence is worth its risk: beside points it would add
// noise to a surface that is there already, in a hole it is all that is known.
#pragma once

#include <vector>

#include "phi/base/array2d.h"
#include "phi/fusion/pixel_outcome.h"

namespace phi {

// A pixel is in a hole when no pixel up to so many (`edge`) columns and rows away gave a point or is covered by one.
inline constexpr int kMaxEdgeOfHole = 3;

// For each pixel of row y whether it is in a hole, and only the difference in normals kept it from giving a point.
std::vector<char> FindHoles(const Array2D<PixelOutcome>& outcomes, int y, int edge = kMaxEdgeOfHole);

}  // namespace phi
