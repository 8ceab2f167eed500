#include "phi/cpu/sector_bests.h"

#include <utility>

#include <gtest/gtest.h>

namespace phi {
namespace {

// Few levels, so that many samples tie; images that are narrower than a sector reaches, and odd ones.
TEST(SectorBests, AreThoseOfEachPixelByItself) {
  for (const auto& [width, height] : {std::pair{61, 40}, std::pair{60, 33}, std::pair{9, 7}, std::pair{1, 3}}) {
    Array2D<float> cost(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) cost(x, y) = 0.1f * static_cast<float>((x * x * 7 + y * 13 + x * y * 5) % 11);
    }
    SectorBests bests;  // one for all rows, whose numbers of pixels differ
    for (int y = 0; y < height; ++y) {
      for (const int first_x : {0, 1}) {
        bests.Find(std::as_const(cost).view(), first_x, y);
        for (int x = first_x; x < width; x += 2) {
          for (int sector = 0; sector < kNumSectors; ++sector) {
            PixelOffset expected, found;
            const bool is_there = BestInSector(std::as_const(cost).view(), x, y, sector, &expected);
            ASSERT_EQ(bests.BestInSector(x, sector, &found), is_there) << x << ", " << y << ", sector " << sector;
            if (!is_there) continue;
            EXPECT_EQ(std::pair(found.dx, found.dy), std::pair(expected.dx, expected.dy)) << x << ", " << y << ", sector " << sector;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace phi
