#include "phi/base/box_sums.h"

#include <algorithm>
#include <vector>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

template <typename Value>
Array2D<std::uint16_t> SumBoxes(ArrayView2D<const Value> image) {
  const int width = image.width, height = image.height;
  Array2D<std::uint16_t> result(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    const Value* rows[3];
    for (int k = 0; k < 3; ++k) rows[k] = &image(0, std::clamp(y + k - 1, 0, height - 1));
    std::vector<std::uint16_t> columns(width + 2);
    for (int x = 0; x < width; ++x) columns[x + 1] = rows[0][x] + rows[1][x] + rows[2][x];
    columns.front() = columns[1];
    columns.back() = columns[width];
    std::uint16_t* sums = &result(0, y);
    for (int x = 0; x < width; ++x) sums[x] = columns[x] + columns[x + 1] + columns[x + 2];
  });
  return result;
}

}  // namespace

Array2D<std::uint16_t> SumBoxes3x3(ArrayView2D<const std::uint8_t> image) { return SumBoxes(image); }
Array2D<std::uint16_t> SumBoxes3x3(ArrayView2D<const std::uint16_t> sums) { return SumBoxes(sums); }

}  // namespace phi
