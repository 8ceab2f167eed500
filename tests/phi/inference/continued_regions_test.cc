#include "phi/inference/continued_regions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "phi/inference/image_regions.h"
#include "phi/inference/region_planes.h"

namespace phi {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr int kWidth = 160, kHeight = 120, kReach = 4;
constexpr int kSide = 6;  // of a cell, in so small an image: rows 3, 9, ... are asked
constexpr int kMaxChange = 10;

struct Picture {
  Array2D<std::int32_t> region{kWidth, kHeight, -1};
  Array2D<std::uint16_t> brightness{kWidth, kHeight, 500};

  // Columns and rows from the first to before the second.
  void Fill(std::int32_t index, std::pair<int, int> columns, std::pair<int, int> rows, std::uint16_t value) {
    for (int y = rows.first; y < rows.second; ++y) {
      for (int x = columns.first; x < columns.second; ++x) region(x, y) = index, brightness(x, y) = value;
    }
  }
  RegionLists Continued(int num_regions = 3) const { return FindContinuedRegions(region, num_regions, brightness, kMaxChange, kReach); }
};

// A wall on either side of a tree.
Picture PartedWall(int change, std::pair<int, int> rows = {0, kHeight}) {
  Picture picture;
  picture.Fill(0, {0, 60}, rows, 100);
  picture.Fill(2, {100, kWidth}, rows, static_cast<std::uint16_t>(100 + change));
  return picture;
}

TEST(ContinuedRegions, AreAsBrightBeyondWhatPartsThem) {
  EXPECT_THAT(PartedWall(kMaxChange).Continued(), ElementsAre(ElementsAre(2), IsEmpty(), ElementsAre(0)));
  EXPECT_THAT(PartedWall(kMaxChange + 1).Continued(), ElementsAre(IsEmpty(), IsEmpty(), IsEmpty()));
}

TEST(ContinuedRegions, LieNextToEachOther) {
  Picture picture = PartedWall(0);
  picture.Fill(1, {75, 90}, {0, kHeight}, 300);
  EXPECT_THAT(picture.Continued(), ElementsAre(IsEmpty(), IsEmpty(), IsEmpty()));
}

TEST(ContinuedRegions, MayTouch) {
  Picture picture;
  picture.Fill(0, {0, 60}, {0, kHeight}, 100);
  picture.Fill(1, {60, kWidth}, {0, kHeight}, 100);
  EXPECT_THAT(picture.Continued(2), ElementsAre(ElementsAre(1), ElementsAre(0)));
}

TEST(ContinuedRegions, LieAboveEachOtherToo) {
  Picture picture;
  picture.Fill(1, {0, kWidth}, {0, 40}, 100);
  picture.Fill(0, {0, kWidth}, {80, kHeight}, 100);
  EXPECT_THAT(picture.Continued(2), ElementsAre(ElementsAre(1), ElementsAre(0)));
}

// Rows 3, 9 and 15.
TEST(ContinuedRegions, ThreeRowsAtLeastAreAlike) {
  EXPECT_THAT(PartedWall(0, {0, 2 * kSide + 4}).Continued()[0], ElementsAre(2));
  EXPECT_THAT(PartedWall(0, {0, 2 * kSide + 3}).Continued()[0], IsEmpty());
}

// Of twenty rows.
TEST(ContinuedRegions, MostRowsAreAlike) {
  for (const int num_alike : {9, 10}) {
    Picture picture = PartedWall(0);
    for (int y = num_alike * kSide; y < kHeight; ++y) {
      std::fill(&picture.brightness(100, y), &picture.brightness(0, y) + kWidth, std::uint16_t{200});
    }
    EXPECT_EQ(picture.Continued()[0].empty(), num_alike < 10) << num_alike;
  }
}

// The last pixels of each are another brightness's in part.
TEST(ContinuedRegions, EdgesDoNotPartThem) {
  const auto continued = [](int num_spoilt) {
    Picture picture = PartedWall(0);
    for (int y = 0; y < kHeight; ++y) {
      for (int i = 0; i < num_spoilt; ++i) picture.brightness(59 - i, y) = 300, picture.brightness(100 + i, y) = 200;
    }
    return !picture.Continued()[0].empty();
  };
  EXPECT_TRUE(continued(kReach));
  EXPECT_FALSE(continued(kReach + 1));
}

// A wall at 0.3 behind a trunk at 0.5. Each half of the wall has anchors at its outer end, and at the trunk the trunk's. By its own the
// left half is a slanted plane through both, which lies before the right half's outer end.
TEST(ContinuedRegions, TellTogetherWhereAPartedWallIs) {
  Array2D<float> anchors(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool is_end = x < 2 || x >= kWidth - 2, is_trunk = x == 55 || x == 104;
      anchors(x, y) = is_end ? 0.3f : is_trunk ? 0.5f : 0;
    }
  }
  const auto at_40 = [&](float factor) {
    Rules rules;
    rules.Set(Rule::kContinuedRegions, factor);
    GrayImage image(kWidth, kHeight, 120);
    for (int y = 0; y < kHeight; ++y) std::fill(&image(60, y), &image(100, y), static_cast<std::uint8_t>(y % 8 < 4 ? 20 : 60));
    auto regions = std::make_shared<const ImageRegions>(FindRegions(image, rules));
    PlaneEvidence evidence;
    evidence.scene = {{9, 0, 0}};  // there is one
    const RegionPlanes planes(regions, std::as_const(anchors).view(), 3, evidence, rules);
    return planes.At(40, 60)[0].InverseDepth(40, 60);
  };
  EXPECT_NEAR(at_40(1), 0.3, 0.003);
  EXPECT_NEAR(at_40(0), 0.3 + 0.2 * 40 / 55, 0.003);
}

}  // namespace
}  // namespace phi
