#include "colmap_ext/evaluation/thin_cloud.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <random>
#include <vector>

namespace colmap_ext {
namespace {

// Two points of one voxel become their mean, one beyond its border stays.
TEST(ThinCloud, LeavesTheMeanOfEachVoxel) {
  const std::vector<phi::Vec3f> thinned =
      ThinCloud({{0.1f, 0.1f, 0.1f}, {0.3f, 0.1f, 0.3f}, {-0.1f, 0, 0}}, 0.5);
  ASSERT_EQ(thinned.size(), 2u);
  EXPECT_NEAR(thinned[0].x, 0.2, 1e-6);
  EXPECT_NEAR(thinned[0].z, 0.2, 1e-6);
  EXPECT_NEAR(thinned[1].x, -0.1, 1e-6);
}

// Against sums by hand, with points on the voxels' borders; a megabyte takes five passes.
TEST(ThinCloud, IsTheSameInAnyMemory) {
  constexpr double kSize = 0.1;
  std::mt19937 random(1);
  std::vector<phi::Vec3f> points;
  for (int i = 0; i < 200000; ++i) {
    const auto coordinate = [&] { return static_cast<float>(static_cast<int>(random() % 401) - 200) * 0.05f; };
    points.push_back({coordinate(), coordinate(), coordinate() / 10});
  }
  std::map<std::array<double, 3>, std::array<double, 4>> sums;
  std::vector<std::array<double, 3>> order;
  for (const phi::Vec3f& p : points) {
    const std::array<double, 3> voxel{std::floor(p.x / kSize), std::floor(p.y / kSize), std::floor(p.z / kSize)};
    std::array<double, 4>& sum = sums[voxel];
    if (sum[3] == 0) order.push_back(voxel);
    sum = {sum[0] + p.x, sum[1] + p.y, sum[2] + p.z, sum[3] + 1};
  }
  for (const std::size_t memory : {std::size_t{1}, std::size_t{1} << 30}) {
    const std::vector<phi::Vec3f> thinned = ThinCloud(points, kSize, memory);
    ASSERT_EQ(thinned.size(), order.size());
    for (std::size_t i = 0; i < thinned.size(); ++i) {
      const std::array<double, 4>& sum = sums[order[i]];
      ASSERT_EQ(thinned[i].x, static_cast<float>(sum[0] / sum[3])) << memory << " bytes, point " << i;
      ASSERT_EQ(thinned[i].y, static_cast<float>(sum[1] / sum[3])) << memory << " bytes, point " << i;
      ASSERT_EQ(thinned[i].z, static_cast<float>(sum[2] / sum[3])) << memory << " bytes, point " << i;
    }
  }
  EXPECT_TRUE(ThinCloud({}, kSize).empty());
}

}  // namespace
}  // namespace colmap_ext
