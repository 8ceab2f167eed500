#include "phi/matching/propagation.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <utility>

#include "phi/base/array2d.h"
#include "phi/matching/estimate_pixel.h"

namespace phi {
namespace {

TEST(Propagation, AllSamplesHaveTheOtherColourAndNoneRepeats) {
  std::set<std::pair<int, int>> seen;
  for (int sector = 0; sector < kNumSectors; ++sector) {
    for (int sample = 0; sample < NumSectorSamples(sector); ++sample) {
      const PixelOffset o = SectorOffset(sector, sample);
      EXPECT_EQ((std::abs(o.dx) + std::abs(o.dy)) % 2, 1) << sector << " " << sample;
      EXPECT_TRUE(seen.insert({o.dx, o.dy}).second) << o.dx << " " << o.dy;
    }
  }
}

TEST(Propagation, SectorsAreRotationsOfEachOther) {
  for (int base : {0, 4}) {
    for (int sample = 0; sample < NumSectorSamples(base); ++sample) {
      for (int direction = 0; direction < 3; ++direction) {
        const PixelOffset a = SectorOffset(base + direction, sample),
                          b = SectorOffset(base + direction + 1, sample);
        EXPECT_EQ(b.dx, -a.dy);
        EXPECT_EQ(b.dy, a.dx);
      }
    }
  }
  EXPECT_EQ(SectorOffset(0, 0).dy, -1);    // up, nearest
  EXPECT_EQ(SectorOffset(4, 10).dy, -23);  // up, farthest
}

TEST(Propagation, PicksTheLowestCostInTheSector) {
  Array2D<float> cost(64, 64, 1.0f);
  const PixelOffset lowest = SectorOffset(6, 7);
  cost(32 + lowest.dx, 32 + lowest.dy) = 0.1f;
  cost(33, 33) = 0.0f;  // same colour: never read
  PixelOffset best;
  ASSERT_TRUE(BestInSector(cost.view(), 32, 32, 6, &best));
  EXPECT_EQ(best.dx, lowest.dx);
  EXPECT_EQ(best.dy, lowest.dy);
  ASSERT_TRUE(BestInSector(cost.view(), 32, 32, 5, &best));  // all equal: the first
  EXPECT_EQ(best.dx, 3);
  EXPECT_EQ(best.dy, 0);
}

TEST(Propagation, SectorOutsideTheImageSendsNothing) {
  const Array2D<float> cost(64, 64, 1.0f);
  PixelOffset best;
  EXPECT_FALSE(BestInSector(cost.view(), 10, 2, 4, &best));
  EXPECT_TRUE(BestInSector(cost.view(), 10, 3, 4, &best));
}

TEST(Propagation, ACandidateThatWasSentBeforeIsFound) {
  EstimationParameters p;
  p.inverse_depth_per_pixel = 1e-3f;
  // Inverse depths 0.5 and 0.25.
  const PlaneHypothesis candidates[2] = {{{0, 0, -1}, 2}, {{0, 0.6f, -0.8f}, 4}};
  EXPECT_EQ(FindSame(p, candidates, 2, {{0, 0.6f, -0.8f}, 4}), 1);
  EXPECT_EQ(FindSame(p, candidates, 1, {{0, 0.6f, -0.8f}, 4}), -1);
  EXPECT_EQ(FindSame(p, candidates, 2, {{0, 0, -1}, 4}), -1) << "another normal";
  EXPECT_EQ(FindSame(p, candidates, 2, {{0, 0, -1}, 1 / 0.50002f}), -1) << "0.02 pixels off";
  EXPECT_EQ(FindSame(p, candidates, 2, {{0, 0, -1}, 1 / 0.5000002f}), 0) << "0.0002 pixels off";
}

}  // namespace
}  // namespace phi
