#include "phi/matching/coarse_start.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "phi/cpu/cpu_estimation.h"
#include "phi/matching/estimation_setup.h"
#include "phi/matching/first_hypothesis.h"
#include "phi/matching/pyramid.h"
#include "tests/support/exact_scenes.h"

namespace phi {
namespace {

using test_support::ExactSceneOptions;
using test_support::InputOf;
using test_support::RenderedScene;

StereoOptions Fast(int num_iterations = 8) {
  StereoOptions options;
  options.quality = Quality::kFast;
  options.num_iterations = num_iterations;
  return options;
}

// Without pixels.
RenderedScene CameraOf(int width, int height) {
  ExactSceneOptions options;
  options.width = width;
  options.height = height;
  RenderedScene scene;
  for (int i = 0; i < 2; ++i) {
    SceneView view;
    view.name = i == 0 ? "a.png" : "b.png";
    view.camera.pinhole = {width, height, 700, 710, 301, 199};
    scene.views.push_back(view);
    scene.images.push_back(nullptr);
  }
  scene.views[1].camera.pose.translation = {-0.5, 0, 0};
  return scene;
}

using Schedule = std::vector<std::tuple<int, int, int>>;  // level, first and end iteration

Schedule ScheduleOf(const EstimationInput& input, const StereoOptions& options) {
  Schedule schedule;
  for (const EstimationPart& part : EstimationParts(input, options)) {
    schedule.emplace_back(part.level, part.first_iteration, part.end_iteration);
  }
  return schedule;
}

TEST(EstimationParts, GoFromAQuarterOfTheSizeToTheWhole) {
  const RenderedScene scene = CameraOf(600, 400);
  EXPECT_EQ(ScheduleOf(InputOf(scene), StereoOptions()), (Schedule{{2, 0, 6}, {1, 4, 8}, {0, 4, 8}}));
  EXPECT_EQ(ScheduleOf(InputOf(scene), Fast()), (Schedule{{2, 0, 5}, {1, 4, 7}, {0, 7, 8}}));
}

TEST(EstimationParts, ThePapersFormKnowsOneSize) {
  const RenderedScene scene = CameraOf(600, 400);
  StereoOptions paper;
  paper.method.formulas = Formulas::kPaper;
  EXPECT_EQ(ScheduleOf(InputOf(scene), paper), (Schedule{{0, 0, 8}}));
}

TEST(EstimationParts, SmallImagesHaveFewerParts) {
  const RenderedScene medium = CameraOf(600, 383), small = CameraOf(191, 600);  // 383 / 4 < 96, 191 / 2 < 96
  EXPECT_EQ(ScheduleOf(InputOf(medium), Fast()), (Schedule{{1, 0, 7}, {0, 7, 8}}));
  EXPECT_EQ(ScheduleOf(InputOf(small), Fast()), (Schedule{{0, 0, 8}}));
}

TEST(EstimationParts, EachHasAnIterationAndTheLastOneEndsAtTheEnd) {
  const RenderedScene scene = CameraOf(600, 400);
  for (int num_iterations = 1; num_iterations <= 20; ++num_iterations) {
    const auto parts = EstimationParts(InputOf(scene), Fast(num_iterations));
    ASSERT_EQ(parts.size(), 3u);
    for (const EstimationPart& part : parts) EXPECT_LT(part.first_iteration, part.end_iteration);
    EXPECT_EQ(parts.front().first_iteration, 0);
    EXPECT_EQ(parts.back().end_iteration, num_iterations);
  }
}

TEST(EstimationParts, HaveTheSameSharesOfFewerIterations) {
  const RenderedScene scene = CameraOf(600, 400);
  EXPECT_EQ(ScheduleOf(InputOf(scene), Fast(6)), (Schedule{{2, 0, 4}, {1, 3, 6}, {0, 5, 6}}));
}

// X = (0.4, -0.3, 2) is at u = 700 * 0.2 + 301 = 441, v = 710 * -0.15 + 199 = 92.5; reduced to a quarter, at a quarter.
TEST(PartInput, ReducesCamerasAndPointsAlike) {
  const RenderedScene scene = CameraOf(601, 402);
  EstimationInput input = InputOf(scene);
  input.sparse = {{441, 92.5f, 2}};
  const PartInput part(input, Fast(), {2, 0, 5});
  const Pinhole& k = part.input().reference.view->camera.pinhole;
  EXPECT_EQ(k.width, 151);  // 601 -> 301 -> 151
  EXPECT_EQ(k.height, 101);
  EXPECT_DOUBLE_EQ(k.fx * 0.2 + k.cx, 441.0 / 4);
  EXPECT_DOUBLE_EQ(k.fy * -0.15 + k.cy, 92.5 / 4);
  EXPECT_FLOAT_EQ(part.input().sparse[0].u, 441.0f / 4);
  EXPECT_FLOAT_EQ(part.input().sparse[0].v, 92.5f / 4);
  EXPECT_FLOAT_EQ(part.input().sparse[0].depth, 2);
  EXPECT_EQ(part.input().sources[0].view->camera.pinhole.width, 151);
  EXPECT_EQ(part.input().sources[0].view->camera.pose.translation, Eigen::Vector3d(-0.5, 0, 0));
  EXPECT_EQ(part.options().num_window_levels, 2);  // of 1/4 and 1/8
  EXPECT_EQ(PartInput(input, Fast(), {1, 4, 7}).options().num_window_levels, 3);
  EXPECT_EQ(input.reference.view->camera.pinhole.width, 601);
}

// The plane 0.3 x - 0.4 y + z = 4, i.e. 1 / z = (0.3 (u - cx) / fx - 0.4 (v - cy) / fy + 1) / 4.
TEST(HypothesisFromCoarse, KeepsThePlane) {
  const RenderedScene scene = CameraOf(601, 402);
  const EstimationInput input = InputOf(scene);
  const auto depth = [](double u, double v) {
    return 4 / (0.3 * (u - 301) / 700 - 0.4 * (v - 199) / 710 + 1);
  };
  const float norm = std::sqrt(0.3f * 0.3f + 0.4f * 0.4f + 1);
  PlaneMap quarter(151, 101);
  for (int y = 0; y < quarter.height(); ++y) {
    for (int x = 0; x < quarter.width(); ++x) {
      quarter(x, y).normal = {-0.3f / norm, 0.4f / norm, -1 / norm};
      quarter(x, y).depth = static_cast<float>(depth(4 * x + 2, 4 * y + 2));  // the middle of 4 x 4 pixels
    }
  }
  EstimationParameters p = MakeEstimationParameters(input, Fast());
  const CoarseHypotheses coarse = {quarter.view(), 2};
  for (int y = 0; y < 402; y += 7) {
    for (int x = 0; x < 601; x += 3) {
      PlaneHypothesis h;
      ASSERT_TRUE(HypothesisFromCoarse(p, coarse, x, y, &h));
      ASSERT_NEAR(h.depth, depth(x + 0.5, y + 0.5), 1e-5 * h.depth) << x << " " << y;
      ASSERT_EQ(h.normal.x, quarter(0, 0).normal.x);
    }
  }
  p.farthest = 3.5f;  // the plane is nearer than that on the right only
  PlaneHypothesis h;
  EXPECT_FALSE(HypothesisFromCoarse(p, coarse, 0, 199, &h));
  EXPECT_TRUE(HypothesisFromCoarse(p, coarse, 600, 0, &h));
}

TEST(CoarseStart, SameBytesForAnyNumberOfThreads) {
  ExactSceneOptions options;
  options.width = 205;
  options.height = 199;
  const RenderedScene scene = test_support::SphereScene(options);
  const EstimationInput input = InputOf(scene);
  ASSERT_EQ(EstimationParts(input, Fast(2)).size(), 2u);
  const EstimationResult one = MakeCpuBackend(1)->Estimate(input, Fast(2));
  const EstimationResult three = MakeCpuBackend(3)->Estimate(input, Fast(2));
  EXPECT_EQ(std::memcmp(one.map.data(), three.map.data(), one.map.bytes()), 0);
  EXPECT_EQ(std::memcmp(one.cost.data(), three.cost.data(), one.cost.bytes()), 0);
}

// Percentage of the slats' pixels, and of the wall's, within 2 % of the truth; the border is left out.
struct SlatScore {
  double slats = 0, wall = 0;
};

SlatScore ScoreSlats(const PlaneMap& map, const PlaneMap& truth, double slat_depth) {
  constexpr int kBorder = 10;
  int count[2] = {}, correct[2] = {};
  for (int y = kBorder; y < truth.height() - kBorder; ++y) {
    for (int x = kBorder; x < truth.width() - kBorder; ++x) {
      const float depth = truth(x, y).depth;
      const int is_wall = depth > 1.1 * slat_depth;
      ++count[is_wall];
      correct[is_wall] += std::abs(map(x, y).depth - depth) < 0.02f * depth;
    }
  }
  return {100.0 * correct[0] / count[0], 100.0 * correct[1] / count[1]};
}

// What the coarsest part alone finds, each of its pixels spread over those that it covers.
PlaneMap EstimateAtAQuarter(const EstimationInput& input) {
  PartInput part(input, StereoOptions(), {2, 0, 5});
  const auto quarter = [](const ViewImage& view) {
    return std::make_shared<const GrayImage>(HalveImage(HalveImage(*view.image)));
  };
  part.input().reference.image = quarter(part.input().reference);
  for (ViewImage& source : part.input().sources) source.image = quarter(source);
  StereoOptions options = part.options();
  options.num_iterations = 5;
  const PlaneMap found = EstimateOnCpu(part.input(), options).map;
  PlaneMap spread(input.reference.image->width(), input.reference.image->height());
  for (int y = 0; y < spread.height(); ++y) {
    for (int x = 0; x < spread.width(); ++x) spread(x, y) = found(x / 4, y / 4);
  }
  return spread;
}

// Slats 6 pixels wide are a pixel and a half wide in the coarsest image, which sees the wall in their place.
TEST(CoarseStart, FindsThinStructuresThatTheCoarsestImageLoses) {
  ExactSceneOptions options;
  options.width = options.height = 400;
  options.focal = 375;
  options.noise_sigma = 2;
  const RenderedScene scene = test_support::SlatScene(options, 6 * options.depth / options.focal);
  const EstimationInput input = InputOf(scene);
  ASSERT_EQ(EstimationParts(input, Fast()).front().level, 2);
  const auto score = [&](const PlaneMap& map) { return ScoreSlats(map, *scene.truth[0], options.depth); };
  StereoOptions at_full_size;
  at_full_size.method.rules.Set(Rule::kCoarseToFine, 0);
  const SlatScore coarse = score(EstimateAtAQuarter(input)), fast = score(EstimateOnCpu(input, Fast()).map),
                  standard = score(EstimateOnCpu(input, StereoOptions()).map),
                  full = score(EstimateOnCpu(input, at_full_size).map);
  std::printf(
      "slats: %.1f %% at a quarter of the size, %.1f fast, %.1f standard, %.1f at full size alone; "
      "wall: %.1f, %.1f, %.1f, %.1f\n",
      coarse.slats, fast.slats, standard.slats, full.slats, coarse.wall, fast.wall, standard.wall, full.wall);
  EXPECT_LT(coarse.slats, 0.2 * full.slats) << "the scene does not test what it should";
  EXPECT_GT(full.slats, 55);
  EXPECT_GT(fast.slats, 0.75 * full.slats);
  EXPECT_GT(standard.slats, 0.85 * full.slats);
  EXPECT_GT(fast.wall, full.wall - 1);
  EXPECT_GT(standard.wall, full.wall - 1);
}

}  // namespace
}  // namespace phi
