#include "phi/base/whole_array.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace phi {
namespace {

// More than one part, and no whole number of them.
constexpr int kWidth = 1021, kHeight = 517;

Array2D<float> Ramp() {
  Array2D<float> ramp(kWidth, kHeight);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp.data()[i] = static_cast<float>(i);
  return ramp;
}

TEST(WholeArray, TransformsEveryElementOnce) {
  const Array2D<int> halves = Transformed(Ramp(), [](float value) { return static_cast<int>(value) / 2; });
  ASSERT_EQ(halves.width(), kWidth);
  ASSERT_EQ(halves.height(), kHeight);
  for (std::size_t i = 0; i < halves.size(); ++i) ASSERT_EQ(halves.data()[i], static_cast<int>(i / 2));
}

TEST(WholeArray, CopiesAll) {
  const Array2D<float> ramp = Ramp();
  std::vector<float> copy(ramp.size() + 1, -1);
  CopyAll(ramp.data(), ramp.size(), copy.data());
  for (std::size_t i = 0; i < ramp.size(); ++i) ASSERT_EQ(copy[i], static_cast<float>(i));
  EXPECT_EQ(copy.back(), -1) << "beyond the end";
}

TEST(WholeArray, CountsWhatIsAskedFor) {
  EXPECT_EQ(CountIf(Ramp(), [](float value) { return static_cast<int>(value) % 7 == 3; }),
            75408);  // 527857 / 7
  EXPECT_EQ(CountIf(Array2D<float>(), [](float) { return true; }), 0);
}

TEST(Array2D, LargeOnesKeepTheirValues) {
  Array2D<std::uint16_t> large(6001, 4003, 7);  // 48 MB: beyond what the heap holds
  large(6000, 4002) = 9;
  const Array2D<std::uint16_t> copy = large;
  large = Array2D<std::uint16_t>(2, 2, 1);
  EXPECT_EQ(copy(0, 0), 7);
  EXPECT_EQ(copy(5999, 4002), 7);
  EXPECT_EQ(copy(6000, 4002), 9);
  EXPECT_EQ(large(1, 1), 1);
}

TEST(Array2D, WithoutAValueHasItsDefault) {
  const Array2D<float> array(50, 30);
  for (const float value : array) ASSERT_EQ(value, 0);
}

}  // namespace
}  // namespace phi
