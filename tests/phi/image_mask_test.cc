#include "phi/base/image_mask.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "phi/geometry/plane_hypothesis.h"

namespace phi {
namespace {

Array2D<std::uint8_t> Row(const std::vector<std::uint8_t>& values) {
  Array2D<std::uint8_t> row(static_cast<int>(values.size()), 1);
  std::copy(values.begin(), values.end(), row.data());
  return row;
}

std::vector<std::uint8_t> Values(const Array2D<std::uint8_t>& row) { return {row.begin(), row.end()}; }

using Bytes = std::vector<std::uint8_t>;

TEST(ImageMask, ExtendsTheNearestUsedPixel) {
  const auto image = Row({10, 99, 99, 99, 99, 200}), mask = Row({255, 0, 0, 0, 0, 1});
  EXPECT_EQ(Values(ExtendIntoMask(image, mask)), (Bytes{10, 10, 10, 200, 200, 200}));
}

// Black beside bright pixels, white beside dark ones: 128 grey levels and more away, where a sample has no weight.
TEST(ImageMask, CutsOutFarFromWhatIsBesideIt) {
  const auto image = Row({10, 99, 99, 99, 99, 200}), mask = Row({255, 0, 0, 0, 0, 255});
  const auto cut = [](const auto& image, const auto& mask) { return Values(CutOutMask(ExtendIntoMask(image, mask), mask)); };
  EXPECT_EQ(cut(image, mask), (Bytes{10, 255, 255, 0, 0, 200}));
  EXPECT_EQ(cut(Row({127, 7, 128}), Row({255, 0, 0})), (Bytes{127, 255, 255}));
  EXPECT_EQ(cut(Row({128, 7}), Row({255, 0})), (Bytes{128, 0}));
}

TEST(ImageMask, ReachesPixelsFromAllSides) {
  const Array2D<std::uint8_t> mask(3, 3, 0);
  for (const auto& [x, y] : {std::pair{0, 0}, {2, 0}, {0, 2}, {2, 2}}) {
    Array2D<std::uint8_t> one = mask;
    one(x, y) = 255;
    Array2D<std::uint8_t> content(3, 3, 9);
    content(x, y) = 77;
    EXPECT_EQ(Values(ExtendIntoMask(content, one)), Bytes(9, 77)) << x << ", " << y;
  }
}

TEST(ImageMask, DropsDepthsUnderIt) {
  PlaneMap map(2, 1, {{0, 0, -1}, 3});
  DropMasked(Row({0, 255}), &map);
  EXPECT_EQ(map(0, 0).depth, 0);
  EXPECT_EQ(map(1, 0).depth, 3);
}

}  // namespace
}  // namespace phi
