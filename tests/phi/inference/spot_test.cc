#include "phi/inference/spot.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

TEST(SpotGrid, EachSpotTellsItsColumnAndRow) {
  int num_moved = 0;  // spots whose cell the image's side cuts off before its middle
  for (int width = 1; width <= 400; ++width) {
    const SpotGrid grid(width, width / 2 + 1);
    const int last = grid.columns - 1;
    EXPECT_LT(grid.At(last, 0).x, width);
    num_moved += grid.At(last, 0).x < last * grid.step + grid.step / 2;
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Spot spot = grid.At(column, row);
        ASSERT_EQ(grid.ColumnOf(spot), column) << width;
        ASSERT_EQ(grid.RowOf(spot), row) << width;
      }
    }
  }
  EXPECT_GT(num_moved, 0);
}

}  // namespace
}  // namespace phi
