#include "phi/base/box_sums.h"

#include <algorithm>
#include <array>
#include <vector>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

using Row = std::vector<std::uint16_t>;

// Sums of threes along a row of `width` values, of which there is one more at either end.
void SumThrees(const Row& padded, int width, std::uint16_t* sums) {
  for (int x = 0; x < width; ++x) sums[x] = padded[x] + padded[x + 1] + padded[x + 2];
}

void Pad(int width, Row* row) {
  row->front() = (*row)[1];
  row->back() = (*row)[width];
}

// Row y of the sums, y beyond the image as at its border. `columns`: scratch of two more than the image's width.
void SumRow(ArrayView2D<const std::uint8_t> image, int y, Row* columns, std::uint16_t* sums) {
  const std::uint8_t* rows[3];
  y = std::clamp(y, 0, image.height - 1);
  for (int k = 0; k < 3; ++k) rows[k] = &image(0, std::clamp(y + k - 1, 0, image.height - 1));
  for (int x = 0; x < image.width; ++x) (*columns)[x + 1] = rows[0][x] + rows[1][x] + rows[2][x];
  Pad(image.width, columns);
  SumThrees(*columns, image.width, sums);
}

}  // namespace

Array2D<std::uint16_t> SumBoxes3x3(ArrayView2D<const std::uint8_t> image) {
  auto result = Array2D<std::uint16_t>::Uninitialized(image.width, image.height);
  tbb::parallel_for(0, image.height, [&](int y) {
    Row columns(image.width + 2);
    SumRow(image, y, &columns, &result(0, y));
  });
  return result;
}

// Rows of the first sums are made three times over: cheaper than to keep them all.
Array2D<std::uint16_t> SumBoxes3x3Twice(ArrayView2D<const std::uint8_t> image) {
  auto result = Array2D<std::uint16_t>::Uninitialized(image.width, image.height);
  tbb::parallel_for(0, image.height, [&](int y) {
    Row columns(image.width + 2);
    std::array<Row, 3> once;
    for (int k = 0; k < 3; ++k) {
      once[k].resize(image.width);
      SumRow(image, y + k - 1, &columns, once[k].data());
    }
    for (int x = 0; x < image.width; ++x) columns[x + 1] = once[0][x] + once[1][x] + once[2][x];
    Pad(image.width, &columns);
    SumThrees(columns, image.width, &result(0, y));
  });
  return result;
}

}  // namespace phi
