#include "phi/fusion/cloud_holes.h"

#include <algorithm>
#include <cstddef>

namespace phi {
namespace {

bool HasPoint(PixelOutcome outcome) {
  return outcome == PixelOutcome::kFused || outcome == PixelOutcome::kCovered;
}

}  // namespace

std::vector<char> FindHoles(const Array2D<PixelOutcome>& outcomes, int y, int edge) {
  const int width = outcomes.width();
  std::vector<char> points(static_cast<std::size_t>(width), 0);  // by column: in the rows around
  const int last = std::min(outcomes.height() - 1, y + edge);
  for (int row = std::max(0, y - edge); row <= last; ++row) {
    const PixelOutcome* of_row = &outcomes(0, row);
    for (int x = 0; x < width; ++x)
      points[static_cast<std::size_t>(x)] |= static_cast<char>(HasPoint(of_row[x]));
  }
  std::vector<char> holes(static_cast<std::size_t>(width), 0);
  int open_since = 0;  // no points from this column to x + edge
  for (int x = 0; x < std::min(edge, width); ++x) {
    if (points[static_cast<std::size_t>(x)] != 0) open_since = x + 1;
  }
  for (int x = 0; x < width; ++x) {
    const int ahead = x + edge;
    if (ahead < width && points[static_cast<std::size_t>(ahead)] != 0) open_since = ahead + 1;
    const bool is_open = std::max(0, x - edge) >= open_since;
    holes[static_cast<std::size_t>(x)] =
        static_cast<char>(is_open && outcomes(x, y) == PixelOutcome::kNormal);
  }
  return holes;
}

}  // namespace phi
