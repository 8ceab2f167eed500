#include "phi/inference/image_regions.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "phi/inference/creases.h"

namespace phi {
namespace {

// Blobs of a few grey levels, finer to the right: many regions of all sizes, some across all rows. Noise of less than one
// grey level, so that a step is 4 / 3 of one.
GrayImage Blobs(int width, int height) {
  GrayImage image(width, height);
  std::uint32_t state = 1;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      state = state * 1664525u + 1013904223u;
      const int cell = x < width / 2 ? (x / 17 + y / 23) % 3 : (x / 2 * 7 + y / 3 * 5) % 4;
      image(x, y) = static_cast<std::uint8_t>(60 + 9 * cell + (state >> 30));
    }
  }
  return image;
}

// Smoothed twice by 3 x 3 pixels, times 81: the weights of five pixels are 1, 2, 3, 2, 1, the border's pixels go on.
int SmoothedSum(const GrayImage& image, int x, int y) {
  const auto at = [&](int u, int v) {
    return image(std::clamp(u, 0, image.width() - 1), std::clamp(v, 0, image.height() - 1));
  };
  int sum = 0;
  for (int v = y - 1; v <= y + 1; ++v) {
    for (int u = x - 1; u <= x + 1; ++u) {
      const int cu = std::clamp(u, 0, image.width() - 1), cv = std::clamp(v, 0, image.height() - 1);
      for (int k = 0; k < 9; ++k) sum += at(cu + k % 3 - 1, cv + k / 3 - 1);
    }
  }
  return sum;
}

TEST(ImageRegions, RunsOfARowEndWhereTheRegionDoes) {
  ImageRegions regions{Array2D<std::int32_t>(6, 3, -1), 2};
  for (const int x : {0, 1, 5}) regions.region(x, 1) = 0;
  regions.region(2, 1) = 1;
  using Run = std::tuple<std::int32_t, int, int>;
  const auto runs = [&](int y) {
    std::vector<Run> found;
    ForRunsOfRow(regions, y, [&](std::int32_t region, int begin, int end) { found.emplace_back(region, begin, end); });
    return found;
  };
  EXPECT_EQ(runs(0), (std::vector<Run>{{-1, 0, 6}}));
  EXPECT_EQ(runs(1), (std::vector<Run>{{0, 0, 2}, {1, 2, 3}, {-1, 3, 5}, {0, 5, 6}}));
}

constexpr int kMaxStep = 108;  // 4 / 3 of a grey level

// The other end of a pixel's link k of four to its neighbours; the pixel itself beyond the border.
std::pair<int, int> Neighbor(const GrayImage& image, int x, int y, int k) {
  const int u = x + (k == 0) - (k == 1), v = y + (k == 2) - (k == 3);
  return u < 0 || v < 0 || u >= image.width() || v >= image.height() ? std::pair{x, y} : std::pair{u, v};
}

// Regions by flooding, one after the other: the pixels within `margin` of which none has a step of more than 4 / 3 grey levels to any of
// its four neighbours; and then the others, each with the most similar one of those within three pixels and the margin.
ImageRegions Flood(const GrayImage& image, int margin) {
  const int reach = 3 + margin;
  const int width = image.width(), height = image.height();
  Array2D<int> sums(width, height);
  Array2D<char> even(width, height, 1), inside(width, height, 1);
  ImageRegions regions{Array2D<std::int32_t>(width, height, -1), 0};
  const auto for_pixels = [&](const auto& function) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) function(x, y);
    }
  };
  for_pixels([&](int x, int y) { sums(x, y) = SmoothedSum(image, x, y); });
  for_pixels([&](int x, int y) {
    for (int k = 0; k < 4; ++k) {
      const auto [u, v] = Neighbor(image, x, y, k);
      if (std::abs(sums(x, y) - sums(u, v)) > kMaxStep) even(x, y) = 0;
    }
  });
  for_pixels([&](int x, int y) {
    for (int dv = -margin; dv <= margin; ++dv) {
      for (int du = -margin; du <= margin; ++du) {
        if (!even(std::clamp(x + du, 0, width - 1), std::clamp(y + dv, 0, height - 1))) inside(x, y) = 0;
      }
    }
  });
  for_pixels([&](int x, int y) {
    if (!inside(x, y) || regions.region(x, y) >= 0) return;
    std::vector<std::pair<int, int>> open = {{x, y}};
    regions.region(x, y) = regions.num_regions;
    while (!open.empty()) {
      const auto [px, py] = open.back();
      open.pop_back();
      for (int k = 0; k < 4; ++k) {
        const auto [u, v] = Neighbor(image, px, py, k);
        if (!inside(u, v) || regions.region(u, v) >= 0) continue;
        regions.region(u, v) = regions.num_regions;
        open.emplace_back(u, v);
      }
    }
    ++regions.num_regions;
  });
  const Array2D<std::int32_t> insides = regions.region;
  for_pixels([&](int x, int y) {
    if (inside(x, y)) return;
    int least = 1 << 30;
    for (int k = 0; k < (2 * reach + 1) * (2 * reach + 1); ++k) {
      const int u = x + k % (2 * reach + 1) - reach, v = y + k / (2 * reach + 1) - reach;
      if (u < 0 || v < 0 || u >= width || v >= height || !inside(u, v)) continue;
      if (std::abs(sums(u, v) - sums(x, y)) >= least) continue;
      least = std::abs(sums(u, v) - sums(x, y));
      regions.region(x, y) = insides(u, v);
    }
  });
  return regions;
}

TEST(ImageRegions, AreThoseOfFlooding) {
  for (const auto& [width, height, margin] : {std::tuple{210, 300, 1}, {37, 129, 1}, {64, 64, 1}, {1, 200, 1}, {90, 1, 1}, {1151, 30, 1}, {1152, 30, 2}, {2300, 70, 3}}) {
    const GrayImage image = Blobs(width, height);
    const ImageRegions expected = Flood(image, margin), found = FindRegions(image);
    ASSERT_EQ(found.num_regions, expected.num_regions) << width << "x" << height;
    EXPECT_TRUE(std::equal(found.region.begin(), found.region.end(), expected.region.begin()))
        << width << "x" << height;
  }
  EXPECT_GT(Flood(Blobs(210, 300), 1).num_regions, 50) << "the image must put the labelling to work";
}

TEST(ImageRegions, AWindingPathIsOneRegion) {
  // A dark path winds up and down through bright walls: its bands are joined only by the turns.
  GrayImage image(120, 400, 200);
  for (int x = 0; x < 120; ++x) {
    for (int y = 8; y < 392; ++y) {
      const int lane = x / 20;
      const bool turn = lane % 2 == 0 ? y >= 380 : y < 20;
      if (x % 20 < 12 || (turn && lane < 5)) image(x, y) = 50;
    }
  }
  const ImageRegions regions = FindRegions(image);
  EXPECT_EQ(regions.region(5, 200), regions.region(105, 200));
  EXPECT_NE(regions.region(5, 200), regions.region(5, 2));
}

// A plain image of one grey level with a dark frame of `side` pixels, which has a gap in its left side.
bool GapJoins(int width, int side, int gap) {
  GrayImage image(width, width / 2, 120);
  const int left = width / 3, top = width / 8;
  for (int k = 0; k <= side; ++k) {
    image(left + k, top) = image(left + k, top + side) = image(left + side, top + k) = 60;
    if (k < 8 || k >= 8 + gap) image(left, top + k) = 60;
  }
  const ImageRegions regions = FindRegions(image);
  const std::int32_t within = regions.region(left + side / 2, top + side / 2);
  EXPECT_GE(within, 0);
  return within == regions.region(10, 10);
}

// The smoothed line and its step take three rows from either end of the gap; what is left lets a margin of n pixels through where it is
// more than 2 n. The frame is too small to hold a core.
TEST(ImageRegions, AGapShorterThanTwoMarginsIsNoWayThrough) {
  EXPECT_FALSE(GapJoins(480, 30, 8));
  EXPECT_TRUE(GapJoins(480, 30, 9));
  EXPECT_FALSE(GapJoins(1536, 60, 10));
  EXPECT_TRUE(GapJoins(1536, 60, 11));
  EXPECT_FALSE(GapJoins(3072, 120, 14));
  EXPECT_TRUE(GapJoins(3072, 120, 15));
}

// Half a neck is a 96th of the width: 5 pixels, and 16; as above, three rows are lost at either end.
TEST(ImageRegions, AGapShorterThanANeckPartsSurfaces) {
  EXPECT_FALSE(GapJoins(480, 80, 16));
  EXPECT_TRUE(GapJoins(480, 80, 17));
  EXPECT_FALSE(GapJoins(1536, 200, 38));
  EXPECT_TRUE(GapJoins(1536, 200, 39));
}

// A frame spoils three pixels and half a neck five more: of the n - 1 within, n - 17 are wide. A core has 15 x 15, the square of the 32nd
// part of the width.
TEST(ImageRegions, WhatHasNoCoreIsNotParted) {
  EXPECT_TRUE(GapJoins(480, 31, 12));
  EXPECT_FALSE(GapJoins(480, 32, 12));
}

TEST(ImageRegions, AFadingEdgeStillParts) {
  // Two walls of 120 and 140 grey levels; for three rows the edge between them is a ramp without a step.
  GrayImage image(80, 60);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      const bool fades = y >= 30 && y < 33;
      image(x, y) = static_cast<std::uint8_t>(fades ? std::clamp(110 + x / 2, 120, 140) : x < 40 ? 120 : 140);
    }
  }
  const ImageRegions regions = FindRegions(image);
  EXPECT_GE(regions.region(10, 10), 0);
  EXPECT_EQ(regions.region(10, 10), regions.region(10, 50));
  EXPECT_NE(regions.region(10, 10), regions.region(70, 10));
  // Smoothing by five pixels makes steps of the links from 37 to 42, so that 36 to 43 are inside none; the two meet at the edge.
  EXPECT_EQ(regions.region(39, 10), regions.region(10, 10));
  EXPECT_EQ(regions.region(40, 10), regions.region(70, 10));
}

TEST(ImageRegions, NoiseDoesNotBreakThem) {
  for (const double deviation : {2, 4, 8, 12}) {
    // Two walls side by side, which stay apart.
    GrayImage image(400, 150);
    std::mt19937 generator(1);
    std::normal_distribution<double> noise(0, deviation);
    for (int y = 0; y < 150; ++y) {
      for (int x = 0; x < 400; ++x) {
        const double value = (x < 200 ? 90 : 140) + noise(generator);
        image(x, y) = static_cast<std::uint8_t>(std::clamp(std::round(value), 0.0, 255.0));
      }
    }
    const ImageRegions regions = FindRegions(image);
    std::vector<int> sizes(regions.num_regions, 0);
    for (const std::int32_t region : regions.region) {
      if (region >= 0) ++sizes[region];
    }
    std::sort(sizes.rbegin(), sizes.rend());
    EXPECT_GT(sizes[1], 0.9 * 200 * 150) << deviation;
    EXPECT_LT(sizes[0], 1.02 * 200 * 150) << deviation;
  }
}

TEST(ImageRegions, DoNotDependOnThreads) {
  const GrayImage image = Blobs(210, 300);
  const ImageRegions all = FindRegions(image);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const ImageRegions alone = FindRegions(image);
  EXPECT_TRUE(std::equal(all.region.begin(), all.region.end(), alone.region.begin()));
}

TEST(ImageRegions, KnowTheirCreases) {
  const GrayImage image = Blobs(210, 300);
  const ImageRegions regions = FindRegions(image);
  const Mask creases = FindCreases(regions.region);
  EXPECT_TRUE(std::equal(creases.begin(), creases.end(), regions.creases.begin(), regions.creases.end()));
  EXPECT_GT(std::count(creases.begin(), creases.end(), 255), 100);
  Rules rules;
  rules.Set(Rule::kCreases, 0);
  EXPECT_TRUE(FindRegions(image, rules).creases.empty());
}

}  // namespace
}  // namespace phi
