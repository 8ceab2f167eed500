// Noise that is put on exact maps of planes and a sphere: it is told, removed, and nothing else is.
#include "phi/fusion/map_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "phi/geometry/device_camera.h"
#include "tests/support/exact_scenes.h"

namespace phi {
namespace {

using test_support::PlaneScene;
using test_support::RenderedScene;
using test_support::SphereScene;

FusionMap ExactMap(const RenderedScene& scene) {
  const PlaneMap& truth = *scene.truth[0];
  FusionMap map(truth.width(), truth.height());
  for (std::size_t i = 0; i < map.size(); ++i) {
    map.data()[i].depth = truth.data()[i].depth;
    map.data()[i].normal = PackNormal(truth.data()[i].normal);
  }
  return map;
}

void AddNoise(double sigma, FusionMap* map) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (FusionPixel& pixel : *map) pixel.depth *= static_cast<float>(1 + sigma * normal(random));
}

// Root mean square of the difference over the depth, of pixels at least 2 from the border.
double RelativeError(const FusionMap& map, const FusionMap& truth) {
  double sum = 0;
  int count = 0;
  for (int y = 2; y + 2 < map.height(); ++y) {
    for (int x = 2; x + 2 < map.width(); ++x, ++count) {
      const double error = map(x, y).depth / truth(x, y).depth - 1;
      sum += error * error;
    }
  }
  return std::sqrt(sum / count);
}

TEST(MapNoise, ExactMapsHaveNone) {
  for (const RenderedScene& scene : {PlaneScene({.num_views = 1}), SphereScene({.num_views = 1})}) {
    const FusionMap map = ExactMap(scene);
    EXPECT_LT(EstimateNoise(map, scene.views[0].camera.pinhole), 2e-5f);
  }
  EXPECT_EQ(EstimateNoise(FusionMap(160, 120), PlaneScene({.num_views = 1}).views[0].camera.pinhole), 0);
  EXPECT_EQ(EstimateNoise(FusionMap(1, 1), PlaneScene({.num_views = 1}).views[0].camera.pinhole), 0);
}

TEST(MapNoise, IsToldOnPlanesAndCurvedSurfaces) {
  for (const RenderedScene& scene : {PlaneScene({.num_views = 1}), SphereScene({.num_views = 1})}) {
    FusionMap map = ExactMap(scene);
    AddNoise(0.002, &map);
    EXPECT_NEAR(EstimateNoise(map, scene.views[0].camera.pinhole), 0.002, 1e-4);
  }
}

// The mean of 25 pixels has a fifth of a pixel's noise. Some of them are taken for another surface, and the filter holds
// back where the window looks rougher than the noise, so it is a little more.
TEST(MapNoise, SmoothingAPlaneLeavesAFifth) {
  const RenderedScene scene = PlaneScene({.num_views = 1});
  const FusionMap truth = ExactMap(scene);
  FusionMap map = truth;
  AddNoise(0.002, &map);
  EXPECT_NEAR(RelativeError(map, truth), 0.002, 1e-4);
  SmoothNoise(0.002f, scene.views[0].camera.pinhole, &map);
  EXPECT_LT(RelativeError(map, truth), 0.3 * 0.002);
  EXPECT_GT(RelativeError(map, truth), 0.19 * 0.002);
}

TEST(MapNoise, SmoothingKeepsSlantsEdgesAndHoles) {
  const RenderedScene scene = PlaneScene({.num_views = 1});
  FusionMap truth = ExactMap(scene);
  // The right half lies 5 % further off, with a hole across both.
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = truth.width() / 2; x < truth.width(); ++x) truth(x, y).depth *= 1.05f;
  }
  for (int x = 0; x < truth.width(); ++x) truth(x, 60).depth = 0;
  FusionMap map = truth;
  SmoothNoise(0.002f, scene.views[0].camera.pinhole, &map);
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x)
      ASSERT_NEAR(map(x, y).depth, truth(x, y).depth, 2e-5f * truth(x, y).depth) << x << " " << y;
  }
}

// A ripple of ++--++-- has a variance four times the noise's, so that a Wiener filter moves pixels a quarter of the way to
// the mean. Of five columns three have the other sign, so the mean lies 1.2 ripples away.
TEST(MapNoise, SmoothingSparesWhatIsRougherThanTheNoise) {
  const RenderedScene scene = PlaneScene({.num_views = 1}, {0, 0, -1});
  const FusionMap truth = ExactMap(scene);
  FusionMap map = truth;
  const auto ripple = [](int x) { return x / 2 % 2 == 0 ? 0.003f : -0.003f; };
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) map(x, y).depth *= 1 + ripple(x);
  }
  const FusionMap rough = map;
  SmoothNoise(0.0015f, scene.views[0].camera.pinhole, &map);
  EXPECT_NEAR(RelativeError(map, rough), 0.25 * 1.2 * 0.003, 2e-5);
}

TEST(MapNoise, InferredPixelsStay) {
  const RenderedScene scene = PlaneScene({.num_views = 1});
  FusionMap map = ExactMap(scene);
  AddNoise(0.002, &map);
  for (FusionPixel& pixel : map) pixel.flags = FusionPixel::kInferred;
  const FusionMap before = map;
  EXPECT_EQ(EstimateNoise(map, scene.views[0].camera.pinhole), 0);
  SmoothNoise(0.002f, scene.views[0].camera.pinhole, &map);
  for (std::size_t i = 0; i < map.size(); ++i) ASSERT_EQ(map.data()[i].depth, before.data()[i].depth);
}

}  // namespace
}  // namespace phi
