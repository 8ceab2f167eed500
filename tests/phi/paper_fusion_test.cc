// The paper's fusion: every pixel that is left gives a point, and takes in those that agree of the images to come.
#include "phi/fusion/paper_fusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/scene_fusers.h"

namespace phi {
namespace {

using test_support::MakeMaps;
using test_support::PlaneScene;
using test_support::RenderedScene;

constexpr FusionOptions kPaperOptions = {.method = Formulas::kPaper, .min_num_views = 1};

PaperFuser MakeFuser(const RenderedScene& scene, std::size_t reference, const FusionOptions& options,
                     std::vector<FusionMap>* maps) {
  std::vector<PaperFuser::Image> to_come;
  for (std::size_t i = reference + 1; i < maps->size(); ++i)
    to_come.push_back({static_cast<std::uint32_t>(i), scene.views[i].camera, &(*maps)[i]});
  return PaperFuser(
      {static_cast<std::uint32_t>(reference), scene.views[reference].camera, &(*maps)[reference]}, to_come,
      options, nullptr);
}

FusedBlock Fuse(const RenderedScene& scene, std::size_t reference, std::vector<FusionMap>* maps) {
  const int height = (*maps)[reference].height();
  return MakeFuser(scene, reference, kPaperOptions, maps).FuseRows(0, height);
}

std::size_t NumMerged(const FusionMap& map) {
  return static_cast<std::size_t>(std::count_if(map.begin(), map.end(), [](const FusionPixel& pixel) {
    return (pixel.flags & FusionPixel::kMerged) != 0;
  }));
}

TEST(PaperFusion, AveragesPointsAndNeedsNoOtherImage) {
  const RenderedScene scene = PlaneScene({}, {0, 0, -1});
  std::vector<FusionMap> maps = MakeMaps(scene);
  for (FusionPixel& pixel : maps[0]) pixel.depth *= 1.004f;
  const FusedBlock block = MakeFuser(scene, 0, kPaperOptions, &maps).FuseRows(60, 61);
  ASSERT_EQ(block.points.size(), static_cast<std::size_t>(maps[0].width()));
  for (std::size_t i = 0; i < block.points.size(); ++i) {
    // The plain mean of one 4.016 and the others' 4.
    EXPECT_NEAR(block.points[i].xyz[2], 4 + 0.016 / block.view_counts[i], 1e-5);
  }
}

// Each measurement is in exactly one point: the numbers of views add up to that of the pixels, and none is counted twice
// though neighbouring pixels of one image fall on the same pixel of another.
TEST(PaperFusion, EveryPixelIsInOnePoint) {
  const RenderedScene scene = PlaneScene({.num_views = 3}, {0.4, -0.2, -1});
  std::vector<FusionMap> maps = MakeMaps(scene);
  std::size_t num_pixels = 0, num_points = 0, num_views = 0;
  for (const FusionMap& map : maps) {
    num_pixels += static_cast<std::size_t>(
        std::count_if(map.begin(), map.end(), [](const FusionPixel& pixel) { return pixel.depth > 0; }));
  }
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const FusedBlock block = Fuse(scene, i, &maps);
    num_points += block.points.size();
    for (const std::uint32_t count : block.view_counts) num_views += count;
  }
  EXPECT_EQ(num_views, num_pixels);
  EXPECT_LT(num_points, num_pixels * 2 / 3);
}

// Two cameras of one place, the second with half the resolution: four pixels of the first fall on each of the second. The
// first of them in raster order takes it in, and nothing is left of the second image.
TEST(PaperFusion, APixelBelongsToTheFirstThatTakesItIn) {
  RenderedScene scene = PlaneScene({.num_views = 2}, {0, 0, -1});
  scene.views[1].camera = scene.views[0].camera;
  Pinhole& half = scene.views[1].camera.pinhole;
  half = {half.width / 2, half.height / 2, half.fx / 2, half.fy / 2, half.cx / 2, half.cy / 2};
  std::vector<FusionMap> maps = MakeMaps(scene);
  maps[1] = FusionMap(half.width, half.height);
  for (FusionPixel& pixel : maps[1]) pixel = {4, PackNormal({0, 0, -1}), {0, 0, 0}, 0};
  for (FusionPixel& pixel : maps[0]) pixel.depth = 4;
  const FusedBlock first = Fuse(scene, 0, &maps);
  ASSERT_EQ(first.points.size(), maps[0].size());
  const int width = maps[0].width();
  for (int y = 0; y < maps[0].height(); ++y) {
    for (int x = 0; x < width; ++x) {
      ASSERT_EQ(first.view_counts[static_cast<std::size_t>(y * width + x)],
                x % 2 == 0 && y % 2 == 0 ? 2u : 1u);
    }
  }
  EXPECT_EQ(NumMerged(maps[1]), maps[1].size());
  const FusedBlock second = Fuse(scene, 1, &maps);
  EXPECT_EQ(second.points.size(), 0u);
  EXPECT_EQ(second.outcomes[PixelOutcome::kCovered], static_cast<std::int64_t>(maps[1].size()));
}

// 1 % of the depth, whatever the normals say; and what is taken in by a point of the first image is no witness for the
// third.
TEST(PaperFusion, OnlyTheDistanceCounts) {
  RenderedScene scene = PlaneScene({.num_views = 2}, {0, 0, -1});
  scene.views[1].camera = scene.views[0].camera;
  const auto num_merged = [&](float depth) {
    std::vector<FusionMap> maps = MakeMaps(scene);
    for (FusionPixel& pixel : maps[0]) pixel = {4, PackNormal({0, 0, -1}), {0, 0, 0}, 0};
    for (FusionPixel& pixel : maps[1]) pixel = {depth, PackNormal({1, 0, -0.1f}), {0, 0, 0}, 0};
    Fuse(scene, 0, &maps);
    return NumMerged(maps[1]);
  };
  // At the image's centre the distance is that of the depths; towards the corners the rays lengthen it.
  EXPECT_GT(num_merged(4 * 1.0099f), 0u);
  EXPECT_EQ(num_merged(4 * 1.0101f), 0u);
}

// Of the depth, not of the distance from the camera: at the corners of a wide image the same difference of depths is too much.
TEST(PaperFusion, TheToleranceIsAShareOfTheDepth) {
  RenderedScene scene = PlaneScene({.focal = 80, .num_views = 2}, {0, 0, -1});
  scene.views[1].camera = scene.views[0].camera;
  std::vector<FusionMap> maps = MakeMaps(scene);
  for (FusionPixel& pixel : maps[0]) pixel = {4, PackNormal({0, 0, -1}), {0, 0, 0}, 0};
  for (FusionPixel& pixel : maps[1]) pixel = {4 * 1.009f, PackNormal({0, 0, -1}), {0, 0, 0}, 0};
  Fuse(scene, 0, &maps);
  const RayModel rays = MakeRayModel(scene.views[0].camera.pinhole);
  for (int y = 0; y < maps[1].height(); ++y) {
    for (int x = 0; x < maps[1].width(); ++x) {
      const float length = Norm(rays.Ray(x + 0.5f, y + 0.5f));
      if (std::abs(0.009f * length - 0.01f) < 1e-5f) continue;
      ASSERT_EQ((maps[1](x, y).flags & FusionPixel::kMerged) != 0, 0.009f * length < 0.01f) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace phi
