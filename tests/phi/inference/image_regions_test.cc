#include "phi/inference/image_regions.h"

#include <algorithm>
#include <cstdlib>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace phi {
namespace {

// Blobs of a few grey levels, finer to the right: many regions of all sizes, some across all rows.
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

int BoxSum(const GrayImage& image, int x, int y) {
  int sum = 0;
  for (int v = y - 1; v <= y + 1; ++v) {
    for (int u = x - 1; u <= x + 1; ++u) {
      sum += image(std::clamp(u, 0, image.width() - 1), std::clamp(v, 0, image.height() - 1));
    }
  }
  return sum;
}

// Regions by flooding, one after the other: neighbours whose 3 x 3 means differ by 2 grey levels at most.
ImageRegions Flood(const GrayImage& image) {
  ImageRegions regions{Array2D<std::int32_t>(image.width(), image.height(), -1), 0};
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (regions.region(x, y) >= 0) continue;
      std::vector<std::pair<int, int>> open = {{x, y}};
      regions.region(x, y) = regions.num_regions;
      while (!open.empty()) {
        const auto [px, py] = open.back();
        open.pop_back();
        for (const auto& [qx, qy] : {std::pair{px - 1, py}, {px + 1, py}, {px, py - 1}, {px, py + 1}}) {
          if (qx < 0 || qy < 0 || qx >= image.width() || qy >= image.height()) continue;
          if (regions.region(qx, qy) >= 0) continue;
          if (std::abs(BoxSum(image, px, py) - BoxSum(image, qx, qy)) > 18) continue;
          regions.region(qx, qy) = regions.num_regions;
          open.emplace_back(qx, qy);
        }
      }
      ++regions.num_regions;
    }
  }
  return regions;
}

TEST(ImageRegions, AreThoseOfFlooding) {
  for (const auto& [width, height] : {std::pair{210, 300}, {37, 129}, {64, 64}, {1, 200}, {90, 1}}) {
    const GrayImage image = Blobs(width, height);
    const ImageRegions expected = Flood(image), found = FindRegions(image);
    ASSERT_EQ(found.num_regions, expected.num_regions) << width << "x" << height;
    EXPECT_TRUE(std::equal(found.region.begin(), found.region.end(), expected.region.begin()))
        << width << "x" << height;
  }
  EXPECT_GT(Flood(Blobs(210, 300)).num_regions, 50) << "the image must put the labelling to work";
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

TEST(ImageRegions, DoNotDependOnThreads) {
  const GrayImage image = Blobs(210, 300);
  const ImageRegions all = FindRegions(image);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const ImageRegions alone = FindRegions(image);
  EXPECT_TRUE(std::equal(all.region.begin(), all.region.end(), alone.region.begin()));
}

}  // namespace
}  // namespace phi
