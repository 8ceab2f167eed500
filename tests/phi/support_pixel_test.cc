// Fusion's rule is written twice: to be read, for a pixel, and to be run, for 16. They agree to the bit.
#include "phi/fusion/support_pixel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "phi/fusion/support_run.h"
#include "tests/support/exact_scenes.h"
#include "tests/support/scene_fusers.h"

namespace phi {
namespace {

using test_support::RenderedScene;

std::uint32_t Bits(float value) { return std::bit_cast<std::uint32_t>(value); }

std::vector<FusionNeighbor> Neighbors(const RenderedScene& scene, const std::vector<FusionMap>& maps, std::size_t reference) {
  std::vector<FusionNeighbor> neighbors;
  for (const bool earlier : {true, false}) {  // earlier ones first, as in ImageFuser
    for (std::size_t i = 0; i < maps.size(); ++i) {
      if (i == reference || (i < reference) != earlier) continue;
      const Pinhole& k = scene.views[i].camera.pinhole;
      neighbors.push_back({static_cast<std::uint32_t>(i), earlier,
                           MakeRelativeView(scene.views[reference].camera, scene.views[i].camera),
                           static_cast<float>(1 / k.fx), static_cast<float>(1 / k.fy), maps[i].view()});
      const RelativeView& view = neighbors.back().view;
      neighbors.back().center = TransposedTimes(view.rotation, -1.0f * view.translation);
    }
  }
  return neighbors;
}

struct Tally {
  int covered = 0, without_depth = 0, other_depth = 0, other_reprojection = 0, other_normal = 0, seen_through = 0, hidden = 0, agreeing = 0,
      dropped = 0;
};

void ExpectSame(const PixelSupport& pixel, const SupportRun& run, int i, Tally* tally) {
  ASSERT_EQ(pixel.has_depth, (run.has_depth >> i & 1) != 0);
  ASSERT_EQ(pixel.is_covered, (run.covered >> i & 1) != 0);
  tally->covered += pixel.is_covered;
  if (!pixel.has_depth || pixel.is_covered) return;
  ASSERT_EQ(pixel.num_without_depth, run.num_without_depth[i]);
  ASSERT_EQ(pixel.num_other_depth, run.num_depth[i]);
  ASSERT_EQ(pixel.num_other_reprojection, run.num_reprojection[i]);
  ASSERT_EQ(pixel.num_other_normal, run.num_normal[i]);
  ASSERT_EQ(pixel.num_seen_through, run.num_seen_through[i]);
  ASSERT_EQ(pixel.num_hidden, run.num_hidden[i]);
  ASSERT_EQ(pixel.num_agreeing, run.num_agreeing[i]);
  ASSERT_EQ(Bits(pixel.point.relative_depth), Bits(run.relative_depth[i]));
  ASSERT_EQ(Bits(pixel.support), Bits(run.support[i]));
  ASSERT_EQ(Bits(pixel.point.least_cosine), Bits(run.least_cosine[i]));
  ASSERT_EQ(pixel.reference_is_near, (run.reference.agrees >> i & 1) != 0);
  ASSERT_EQ(pixel.point.num_views, run.num_views[i]);
  ASSERT_EQ(pixel.point.num_inferred, run.num_inferred[i]);
  for (int c = 0; c < 3; ++c) ASSERT_EQ(pixel.point.rgb_sum[c], run.rgb_sum[c][i]);
  ASSERT_EQ(pixel.point.brightness_squares, run.brightness_squares[i]);
  ASSERT_EQ(Bits(pixel.point.normal_sum.x), Bits(run.normal_sum[0][i]));
  ASSERT_EQ(Bits(pixel.point.normal_sum.y), Bits(run.normal_sum[1][i]));
  ASSERT_EQ(Bits(pixel.point.normal_sum.z), Bits(run.normal_sum[2][i]));
  NeighborSet views;
  for (const std::uint32_t k : run.agreeing) {
    if ((run.answers[k].agrees >> i & 1) != 0) views.Add(static_cast<int>(k));
  }
  ASSERT_TRUE(pixel.views == views);
  tally->without_depth += pixel.num_without_depth;
  tally->other_depth += pixel.num_other_depth;
  tally->other_reprojection += pixel.num_other_reprojection;
  tally->other_normal += pixel.num_other_normal;
  tally->seen_through += pixel.num_seen_through;
  tally->hidden += pixel.num_hidden;
  tally->agreeing += pixel.num_agreeing - 1;
  tally->dropped += pixel.num_agreeing - pixel.point.num_views;
}

void CompareImage(const RenderedScene& scene, const std::vector<FusionMap>& maps, std::size_t image, const FusionGates& gates,
                  Tally* tally, bool all_stand_apart = true) {
  std::vector<FusionNeighbor> neighbors = Neighbors(scene, maps, image);
  for (std::size_t k = 0; k < neighbors.size(); k += 2) neighbors[k].stands_apart = all_stand_apart;
  const FusionMap& map = maps[image];
  const RayModel rays = MakeRayModel(scene.views[image].camera.pinhole);
  SupportRun run(neighbors);
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x + kRunLength <= map.width(); x += kRunLength) {
      ReferenceRun reference;
      reference.fx = rays.fx;
      reference.ray_y = rays.Ray(0, y + 0.5f).y;
      for (int i = 0; i < kRunLength; ++i) {
        std::uint32_t words[FusionPixel::kNumWords];
        std::memcpy(words, &map(x + i, y), sizeof(words));
        reference.depth[i] = map(x + i, y).depth;
        reference.normal[i] = words[FusionPixel::kNormalWord];
        reference.color[i] = words[FusionPixel::kColorWord];
        reference.ray_x[i] = rays.Ray(x + i + 0.5f, 0).x;
      }
      DecideRun(neighbors, gates, reference, &run);
      for (int i = 0; i < kRunLength; ++i) {
        const ReferencePixel pixel = {map(x + i, y), {reference.ray_x[i], reference.ray_y, 1}, rays.fx};
        ExpectSame(DecidePixel(neighbors.data(), static_cast<int>(neighbors.size()), gates, pixel), run, i, tally);
        if (testing::Test::HasFatalFailure()) FAIL() << "image " << image << ", pixel " << x + i << ", " << y;
      }
    }
  }
}

TEST(SupportPixel, IsTheRunsRuleToTheBit) {
  Tally tally;
  FusionGates few, strict;
  few.max_num_views = 2;  // drops agreeing images beyond the second
  strict.max_reproj_error = 0.2f;
  for (const RenderedScene& scene : {test_support::PlaneScene(), test_support::SphereScene()}) {
    const std::vector<FusionMap> maps = test_support::MakeNoisyMaps(scene);
    for (std::size_t image = 0; image < maps.size(); ++image) {
      for (const FusionGates& gates : {FusionGates(), few, strict}) CompareImage(scene, maps, image, gates, &tally);
      CompareImage(scene, maps, image, FusionGates(), &tally, /*all_stand_apart=*/false);
      if (HasFatalFailure()) return;
    }
  }
  for (const int count : {tally.covered, tally.without_depth, tally.other_depth, tally.other_reprojection, tally.other_normal,
                          tally.seen_through, tally.hidden, tally.agreeing, tally.dropped}) {
    EXPECT_GT(count, 100);
  }
}

// In world coordinates, where no neighbour's frame comes in.
TEST(SupportPixel, KnowsTheWidestAngleOfItsViews) {
  const RenderedScene scene = test_support::SphereScene();
  const std::vector<FusionMap> maps = test_support::MakeNoisyMaps(scene);
  const std::vector<FusionNeighbor> neighbors = Neighbors(scene, maps, 1);
  const Camera& camera = scene.views[1].camera;
  const RayModel rays = MakeRayModel(camera.pinhole);
  const auto center_of = [](const Pose& pose) -> Eigen::Vector3d { return -(pose.rotation.transpose() * pose.translation); };
  int num_compared = 0;
  for (int y = 0; y < maps[1].height(); ++y) {
    for (int x = 0; x < maps[1].width(); ++x) {
      const ReferencePixel reference = {maps[1](x, y), rays.Ray(x + 0.5f, y + 0.5f), rays.fx};
      const PixelSupport pixel = DecidePixel(neighbors.data(), static_cast<int>(neighbors.size()), FusionGates(), reference);
      if (!pixel.has_depth || pixel.is_covered) continue;
      const double depth = static_cast<double>(reference.pixel.depth) * (1 + static_cast<double>(pixel.point.relative_depth));
      const Eigen::Vector3d in_frame = depth * Eigen::Vector3d(reference.ray.x, reference.ray.y, 1);
      const Eigen::Vector3d world = camera.pose.rotation.transpose() * (in_frame - camera.pose.translation);
      double least = 1;
      for (std::size_t k = 0; k < neighbors.size(); ++k) {
        if (!pixel.views.Contains(static_cast<int>(k))) continue;
        const Eigen::Vector3d theirs = world - center_of(scene.views[neighbors[k].image].camera.pose);
        least = std::min(least, (world - center_of(camera.pose)).normalized().dot(theirs.normalized()));
      }
      ASSERT_NEAR(pixel.point.least_cosine, least, 1e-6) << x << ", " << y;
      num_compared += pixel.point.num_views > 2 ? 1 : 0;
    }
  }
  EXPECT_GT(num_compared, 100);
}

}  // namespace
}  // namespace phi
