#include "phi/inference/scored_anchors.h"

#include <span>
#include <vector>

#include <gtest/gtest.h>

namespace phi {
namespace {

struct Anchor {
  float x, y, w, tolerance;
};

// On the plane 0.5 + 0.25 x - 0.125 y or an eighth off it, where every `nth_off` is not; numbers that floats hold.
std::vector<Anchor> Anchors(int count, int nth_off) {
  std::vector<Anchor> anchors;
  for (int i = 0; i < count; ++i) {
    const auto x = static_cast<float>(i % 17), y = static_cast<float>(i / 17);
    anchors.push_back({x, y, 0.5f + 0.25f * x - 0.125f * y + (i % nth_off == 0 ? 0.125f : 0), 0.0625f});
  }
  return anchors;
}

const ImagePlane kPlane{0.5, 0.25, -0.125};

TEST(ScoredAnchors, CountsThoseOnThePlane) {
  const std::vector<Anchor> anchors = Anchors(700, 5);
  EXPECT_EQ(ScoredAnchors(std::span<const Anchor>(anchors)).CountInliers(kPlane, 0), 560u);
}

TEST(ScoredAnchors, MayBeEveryNth) {
  const std::vector<Anchor> anchors = Anchors(701, 3);
  const ScoredAnchors third(std::span<const Anchor>(anchors), 3), fifth(std::span<const Anchor>(anchors), 5);
  EXPECT_EQ(third.size(), 234u);
  EXPECT_EQ(third.CountInliers(kPlane, 0), 0u);
  EXPECT_EQ(fifth.size(), 141u);
  EXPECT_EQ(fifth.CountInliers(kPlane, 0), 94u);
}

// Of the first 500 none is on it, of the others all.
TEST(ScoredAnchors, StopsWhereTheRestCannotMakeUpForIt) {
  std::vector<Anchor> anchors = Anchors(1000, 2000);
  for (std::size_t i = 0; i < 500; ++i) anchors[i].w += 1;
  const ScoredAnchors scored{std::span<const Anchor>(anchors)};
  EXPECT_EQ(scored.CountInliers(kPlane, 499), 500u);
  EXPECT_LT(scored.CountInliers(kPlane, 600), 100u) << "from the 513th on it cannot be more than 600";
}

}  // namespace
}  // namespace phi
