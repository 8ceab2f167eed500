// The confidences of an image's pixels: those of the points that they gave, or would have given.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "phi/fusion/image_fusion.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/scene_fusers.h"

namespace phi {
namespace {

using test_support::MakeFuser;
using test_support::MakeMaps;
using test_support::MakeNoisyMaps;
using test_support::PlaneScene;
using test_support::RenderedScene;
using test_support::SphereScene;

Array2D<float> Rate(const ImageFuser& fuser, const FusionMap& map, int rows_per_block = 1 << 20) {
  Array2D<float> confidence(map.width(), map.height(), 0);
  for (int y = 0; y < map.height(); y += rows_per_block) fuser.RateRows(y, std::min(y + rows_per_block, map.height()), &confidence);
  return confidence;
}

int Percent(float confidence) { return static_cast<int>(std::lround(100 * confidence)); }

// In the order of the points of a pass: the pixels that gave one since `before`.
std::vector<std::size_t> NewlyEmitted(const FusionMap& map, const FusionMap& before) {
  std::vector<std::size_t> pixels;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto is_emitted = [i](const FusionMap& m) { return (m.data()[i].flags & FusionPixel::kEmitted) != 0; };
    if (is_emitted(map) && !is_emitted(before)) pixels.push_back(i);
  }
  return pixels;
}

struct Fused {
  std::vector<Array2D<float>> confidences;  // of each image
  std::vector<FusionMap> maps;
  int num_points = 0, num_in_holes = 0, num_covered = 0, num_alone = 0;
};

// All images in turn; every point is compared with its pixel.
Fused FuseAndRate(const RenderedScene& scene, const FusionOptions& options, std::vector<FusionMap> maps) {
  Fused fused;
  for (std::size_t k = 0; k < maps.size(); ++k) {
    ImageFuser fuser = MakeFuser(scene, k, options, &maps);
    const int height = maps[k].height();
    std::vector<std::pair<std::size_t, int>> points;  // pixel, per cent
    OutcomeCounts outcomes;
    const auto note = [&](const FusionMap& before, const FusedBlock& block, int* count) {
      const std::vector<std::size_t> pixels = NewlyEmitted(maps[k], before);
      ASSERT_EQ(pixels.size(), block.points.size());
      for (std::size_t i = 0; i < pixels.size(); ++i) points.emplace_back(pixels[i], block.points[i].confidence);
      *count += static_cast<int>(pixels.size());
      outcomes += block.outcomes;
    };
    FusionMap before = maps[k];
    const FusedBlock first = fuser.FuseRows(0, height);
    note(before, first, &fused.num_points);
    before = maps[k];
    const FusedBlock second = fuser.FillHoles(0, height);
    note(before, second, &fused.num_in_holes);
    fused.num_covered += static_cast<int>(outcomes[PixelOutcome::kCovered]);
    fused.num_alone += static_cast<int>(outcomes[PixelOutcome::kTooFewViews] + outcomes[PixelOutcome::kDepth]);
    fused.confidences.push_back(Rate(fuser, maps[k], 7));
    for (const auto& [pixel, percent] : points)
      EXPECT_EQ(Percent(fused.confidences[k].data()[pixel]), percent) << "image " << k << ", pixel " << pixel;
  }
  fused.maps = std::move(maps);
  return fused;
}

// Of which nothing was fused. In the middle, where all views look, their normals differ by 15 degrees and more: a hole.
std::vector<FusionMap> NoisyMaps(const RenderedScene& scene) {
  std::vector<FusionMap> maps = MakeNoisyMaps(scene);
  for (std::size_t k = 0; k < maps.size(); ++k) {
    for (FusionPixel& pixel : maps[k]) pixel.flags &= FusionPixel::kInferred;
    const float turn = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / static_cast<float>(maps.size());
    const Vec3f tilted = Normalized({0.3f * std::cos(turn), 0.3f * std::sin(turn), -1});
    for (int y = 45; y < 75; ++y) {
      for (int x = 65; x < 95; ++x) maps[k](x, y).normal = PackNormal(tilted);
    }
  }
  return maps;
}

TEST(ConfidenceMap, APixelHasTheConfidenceOfItsPoint) {
  const RenderedScene scene = SphereScene();
  const Fused fused = FuseAndRate(scene, {}, NoisyMaps(scene));
  EXPECT_GT(fused.num_points, 1000);
  EXPECT_GT(fused.num_in_holes, 100);
  EXPECT_GT(fused.num_covered, 1000);
  EXPECT_GT(fused.num_alone, 1000);
  for (std::size_t k = 0; k < fused.maps.size(); ++k) {
    for (std::size_t i = 0; i < fused.maps[k].size(); ++i) {
      const float confidence = fused.confidences[k].data()[i];
      if (fused.maps[k].data()[i].depth > 0) {
        ASSERT_TRUE(confidence > 0 && confidence < 1) << confidence;
      } else {
        ASSERT_EQ(confidence, 0);
      }
    }
  }
}

// The point that a covered pixel would give: fused as if no image came before.
TEST(ConfidenceMap, ACoveredPixelHasThatOfThePointSeededThere) {
  const RenderedScene scene = SphereScene();
  const FusionOptions options = {.max_normal_error_in_holes = 0};
  const Fused fused = FuseAndRate(scene, options, NoisyMaps(scene));
  std::vector<FusionMap> maps = NoisyMaps(scene);
  int num_compared = 0;
  for (std::size_t k = 0; k < maps.size(); ++k) {
    const FusionMap before = maps[k];
    // Nothing is emitted in the others' maps, so nothing covers.
    ImageFuser fuser = MakeFuser(scene, k, options, &maps);
    const FusedBlock block = fuser.FuseRows(0, before.height());
    const std::vector<std::size_t> pixels = NewlyEmitted(maps[k], before);
    ASSERT_EQ(pixels.size(), block.points.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      ASSERT_EQ(Percent(fused.confidences[k].data()[pixels[i]]), block.points[i].confidence);
      num_compared += (fused.maps[k].data()[pixels[i]].flags & FusionPixel::kEmitted) == 0;
    }
    maps[k] = before;
  }
  EXPECT_GT(num_compared, 1000) << "no pixel was covered: nothing is tested";
}

// Three cameras side by side look along z at the plane z = 4; the middle pixel's point is (0, 0, 4) to half a pixel.
TEST(ConfidenceMap, ValueByHand) {
  RenderedScene scene = PlaneScene({.num_views = 3}, {0, 0, -1});
  for (int k = 1; k < 3; ++k) {
    scene.views[k].camera = scene.views[0].camera;
    scene.views[k].camera.pose.translation = {-0.4 * k, 0, 0};
  }
  std::vector<FusionMap> maps = MakeMaps(scene);
  for (std::size_t k = 0; k < 3; ++k) {
    for (FusionPixel& pixel : maps[k]) pixel = {4, PackNormal({0, 0, -1}), {90, 90, 90}, 0};
  }
  for (FusionPixel& pixel : maps[1]) pixel = {4, PackNormal({0, 0, -1}), {110, 110, 110}, FusionPixel::kInferred};
  for (FusionPixel& pixel : maps[2]) pixel.depth = 4.5f;  // another surface, behind
  const Pinhole& k = scene.views[0].camera.pinhole;
  const int x = static_cast<int>(k.cx), y = static_cast<int>(k.cy);
  const float value = Rate(MakeFuser(scene, 0, {}, &maps), maps[0])(x, y);
  // One image measured it, two of three agree, 10 grey levels from their mean.
  const double angle = std::atan(0.4 / 4) * 180 / std::numbers::pi;
  const double log_odds = -1.34 + 1.549 * std::log2(2) + 3.394 * 2 / 3 + 0.41 * std::log2(0.3 + angle) - 0.308 * std::log2(11);
  EXPECT_NEAR(value, 1 / (1 + std::exp(-log_odds)), 1e-3);
}

// Every seventh pixel of each image is off by 3 % to 20 %: a right one has nearly always the higher value.
TEST(ConfidenceMap, RightPixelsHaveHigherValuesThanPlantedWrongOnes) {
  const RenderedScene scene = SphereScene();
  std::vector<FusionMap> maps = MakeMaps(scene);
  const auto is_wrong = [](std::size_t k, std::size_t i) { return (i + 3 * k) % 7 == 0; };
  for (std::size_t k = 0; k < maps.size(); ++k) {
    for (std::size_t i = 0; i < maps[k].size(); ++i) {
      FusionPixel& pixel = maps[k].data()[i];
      if (is_wrong(k, i)) pixel.depth *= (i % 2 == 0 ? 1.0f : -1.0f) * (0.03f + 0.0017f * static_cast<float>(i % 101)) + 1;
    }
  }
  std::vector<float> right, wrong;
  const Fused fused = FuseAndRate(scene, {}, maps);
  for (std::size_t k = 0; k < maps.size(); ++k) {
    for (std::size_t i = 0; i < maps[k].size(); ++i) {
      if (maps[k].data()[i].depth > 0) (is_wrong(k, i) ? wrong : right).push_back(fused.confidences[k].data()[i]);
    }
  }
  std::sort(wrong.begin(), wrong.end());
  double num_ordered = 0;
  for (const float value : right) {
    num_ordered += static_cast<double>(std::lower_bound(wrong.begin(), wrong.end(), value) - wrong.begin());
  }
  EXPECT_GT(num_ordered / (static_cast<double>(right.size()) * static_cast<double>(wrong.size())), 0.95);
}

TEST(ConfidenceMap, RowsAndInstructionSetsDoNotChangeTheBytes) {
  const RenderedScene scene = SphereScene();
  std::vector<FusionMap> maps = NoisyMaps(scene);
  ImageFuser fuser = MakeFuser(scene, 2, {}, &maps);
  fuser.FuseRows(0, maps[2].height());
  fuser.FillHoles(0, maps[2].height());
  const auto bytes = [&](int rows) {
    const Array2D<float> map = Rate(fuser, maps[2], rows);
    std::vector<char> all(map.size() * sizeof(float));
    std::memcpy(all.data(), map.data(), all.size());
    return all;
  };
  const std::vector<char> expected = bytes(1 << 20);
  EXPECT_TRUE(bytes(1) == expected);
  EXPECT_TRUE(bytes(13) == expected);
  for (const std::int64_t target : {HWY_SCALAR, HWY_SSE4, HWY_AVX2, HWY_AVX3}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    const std::vector<char> other = bytes(1 << 20);
    hwy::SetSupportedTargetsForTest(0);
    EXPECT_TRUE(other == expected) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace phi
