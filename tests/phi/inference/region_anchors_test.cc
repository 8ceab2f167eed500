// Which anchors a region's planes rest on, on an image of one region: counts and values follow from what is put there.
#include "phi/inference/region_anchors.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/shared_regions.h"

namespace phi {
namespace {

constexpr int kWidth = 300, kHeight = 200;
const AnchorTolerance kTolerance{0.003f, 3, {}};

// Two even halves with a sharp edge between.
std::shared_ptr<const ImageRegions> Halves() {
  GrayImage image(kWidth, kHeight, 60);
  for (int y = 0; y < kHeight; ++y) std::fill(&image(kWidth / 2, y), &image(0, y) + kWidth, 160);
  return SharedRegions(image);
}

float Depth(int x, int y) { return 0.3f + 0.0001f * static_cast<float>(x) + 0.001f * static_cast<float>(y); }

// Every `step`-th pixel of the left half.
Array2D<float> AnchorsOfTheLeft(int step) {
  Array2D<float> anchors(kWidth, kHeight);
  for (int y = 0; y < kHeight; y += step) {
    for (int x = 0; x < kWidth / 2; x += step) anchors(x, y) = Depth(x, y);
  }
  return anchors;
}

TEST(RegionAnchors, RegionsWithTooFewTakeNoPart) {
  const auto regions = Halves();
  ASSERT_EQ(regions->num_regions, 2);
  const Array2D<float> anchors = AnchorsOfTheLeft(10);  // 15 x 20
  const std::vector<PooledAnchor> pooled(299, {200, 100, 0.5f, 1});
  const RegionAnchors left(*regions, anchors.view(), pooled, 300);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left.region(0), 0);
  EXPECT_EQ(left.index(), (std::vector<std::int32_t>{0, -1}));
  EXPECT_EQ(left.Points(0, kTolerance).size(), 300u);
  EXPECT_EQ(RegionAnchors(*regions, anchors.view(), pooled, 299).size(), 2u);
  EXPECT_EQ(RegionAnchors(*regions, anchors.view(), pooled, 301).size(), 0u);
}

TEST(RegionAnchors, PointsAreTheAnchorsByHash) {
  const Array2D<float> anchors = AnchorsOfTheLeft(5);
  const std::vector<PooledAnchor> pooled = {{20.3f, 31.6f, 0.9f, 77}, {20.3f, 31.6f, 0.7f, 77}, {22, 30, 0.9f, 5}};
  const std::vector<RegionPoint> points = RegionAnchors(*Halves(), anchors.view(), pooled, 1).Points(0, kTolerance);
  ASSERT_EQ(points.size(), 30u * 40 + 3);
  std::size_t num_pooled = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const RegionPoint& p = points[i];
    // Two views' pixels may share a hash: then the place and depth decide.
    const auto key = [](const RegionPoint& q) { return std::tuple(q.hash, q.x, q.y, q.w); };
    if (i > 0) { EXPECT_LT(key(points[i - 1]), key(p)); }
    EXPECT_FLOAT_EQ(p.tolerance, 0.003f * p.w);
    if (p.w > 0.6f) {
      ++num_pooled;
    } else {
      EXPECT_EQ(p.w, Depth(static_cast<int>(p.x), static_cast<int>(p.y)));
    }
  }
  EXPECT_EQ(num_pooled, 3u);
}

TEST(RegionAnchors, PointsKnowWhetherTheyAreMeasured) {
  const Array2D<float> anchors = AnchorsOfTheLeft(50);
  StateMap states(kWidth, kHeight, PixelState::kClue);
  states(50, 100) = PixelState::kMeasured;
  const std::vector<PooledAnchor> pooled = {{20, 31, 0.9f, 77}, {22, 30, 0.9f, 5, false}};
  const RegionAnchors told(*Halves(), anchors.view(), pooled, 1, std::as_const(states).view());
  for (const RegionPoint& p : told.Points(0, kTolerance)) {
    EXPECT_EQ(p.is_measured, (p.x == 50 && p.y == 100) || p.x == 20) << p.x << ", " << p.y;
  }
  const RegionAnchors untold(*Halves(), anchors.view(), {}, 1);
  for (const RegionPoint& p : untold.Points(0, kTolerance)) EXPECT_TRUE(p.is_measured);
}

// 1 measured pixel beside 1 clue and 1 pooled clue; then 2 measured ones; then 3.
TEST(RegionAnchors, CluesAreLeftOutWhereMostWasMeasured) {
  Array2D<float> anchors(kWidth, kHeight);
  StateMap states(kWidth, kHeight, PixelState::kMeasured);
  states(70, 50) = PixelState::kClue;
  anchors(70, 50) = anchors(40, 50) = 0.4f;
  const std::vector<PooledAnchor> pooled = {{22, 30, 0.9f, 5, false}};
  const auto sizes = [&] {
    const std::vector<RegionPoint> points = RegionAnchors(*Halves(), anchors.view(), pooled, 1, std::as_const(states).view()).Points(0, kTolerance);
    return std::pair<std::int64_t, std::int64_t>(std::ranges::count_if(points, [](const RegionPoint& p) { return p.is_measured; }), std::ssize(points));
  };
  EXPECT_EQ(sizes(), (std::pair<std::int64_t, std::int64_t>(1, 3)));
  anchors(41, 50) = 0.4f;
  EXPECT_EQ(sizes(), (std::pair<std::int64_t, std::int64_t>(2, 4))) << "half is not most";
  anchors(42, 50) = 0.4f;
  EXPECT_EQ(sizes(), (std::pair<std::int64_t, std::int64_t>(3, 3)));
}

// About 8192 of 30000, spread evenly, by any number of threads; one anchor less leaves the others.
TEST(RegionAnchors, LargeRegionsAreSampledByPixel) {
  const auto regions = Halves();
  Array2D<float> anchors = AnchorsOfTheLeft(1);
  const auto sample = [&] { return RegionAnchors(*regions, anchors.view(), {}, 1).Points(0, kTolerance); };
  const std::vector<RegionPoint> points = sample();
  EXPECT_NEAR(static_cast<double>(points.size()), 8192, 300);
  std::map<std::pair<int, int>, int> blocks;  // of 50 x 50 pixels
  for (const RegionPoint& p : points) ++blocks[{static_cast<int>(p.x) / 50, static_cast<int>(p.y) / 50}];
  ASSERT_EQ(blocks.size(), 12u);
  for (const auto& [block, count] : blocks) EXPECT_NEAR(count, 8192 / 12, 120) << block.first << ", " << block.second;
  const auto same = [](const RegionPoint& p, const RegionPoint& q) { return p.hash == q.hash && p.x == q.x && p.y == q.y; };
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_TRUE(std::ranges::equal(sample(), points, same));
  }
  anchors(static_cast<int>(points[100].x), static_cast<int>(points[100].y)) = 0;
  const std::vector<RegionPoint> fewer = sample();
  std::size_t num_shared = 0;
  for (const RegionPoint& p : fewer) num_shared += std::ranges::any_of(points, [&](const RegionPoint& q) { return same(p, q); });
  EXPECT_GE(num_shared, points.size() - 4);
}

}  // namespace
}  // namespace phi
