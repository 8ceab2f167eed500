#include "phi/cpu/simd_matcher.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <Eigen/Geometry>

#include "phi/cpu/scalar_matcher.h"
#include "phi/matching/estimation_setup.h"
#include "phi/matching/random_hypothesis.h"

namespace phi {
namespace {

// Noise that was smoothed a little, and a patch without any texture in the lower left.
std::shared_ptr<const GrayImage> Texture(int width, int height, int seed) {
  std::mt19937 random(seed);
  Array2D<double> noise(width + 2, height + 2);
  for (double& value : noise) value = random() % 256;
  auto image = std::make_shared<GrayImage>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = 0; k < 9; ++k) sum += noise(x + k % 3, y + k / 3);
      const bool blank = x < width / 4 && y > 3 * height / 4;
      (*image)(x, y) = blank ? 90 : static_cast<std::uint8_t>(std::lround(sum / 9));
    }
  }
  return image;
}

// A reference and four sources of other sizes, turned and shifted.
struct Scene {
  std::vector<SceneView> views;
  EstimationInput input;
  EstimationParameters parameters;
  std::vector<RelativeView> relative;

  explicit Scene(double window_radius = 7, double window_step = 1.4, int num_levels = 1) : views(5) {
    for (int k = 0; k < 5; ++k) {
      const int width = 240 + 31 * k, height = 200 - 13 * k;
      views[k].image_id = k + 1;
      views[k].camera.pinhole = {width, height, 220.0 + 5 * k, 225.0, width / 2.0 + k, height / 2.0 - k};
      views[k].camera.pose.rotation =
          Eigen::AngleAxisd(0.1 * k, Eigen::Vector3d(1, 2, 3 - k).normalized()).toRotationMatrix();
      views[k].camera.pose.translation = {0.3 * (k % 2), -0.2 * (k / 2), 0.1 * k};
      const ViewImage image = {&views[k], Texture(width, height, k)};
      if (k == 0) input.reference = image;
      if (k > 0) input.sources.push_back(image);
    }
    input.noise = 2;  // so that wide windows are taken, too
    input.depth_min = 2;
    input.depth_max = 8;
    StereoOptions options;
    options.window_radius = window_radius;
    options.window_step = window_step;
    options.num_window_levels = num_levels;
    parameters = MakeEstimationParameters(input, options);
    parameters.num_levels = num_levels;  // as many on these small images, too
    relative = MakeRelativeViews(input);
  }

  PlaneHypothesis Hypothesis(int x, int y, std::uint32_t seed) const {
    return RandomHypothesis(parameters.reference, x, y, {2, 8}, {seed, 1}, Formulas::kRobust);
  }

  // Whether rounding may decide if the window is inside the source.
  bool OnTheEdge(int x, int y, const PlaneHypothesis& h, int j) const {
    const float u = x + 0.5f, v = y + 0.5f;
    const Mat3f m = PlaneHomography(relative[j], InverseDepthCoefficients(parameters.reference, u, v, h));
    const GrayImage& image = *input.sources[j].image;
    const auto inside = [&](float radius) {
      return WindowIsInside(m, u, v, radius, image.width(), image.height());
    };
    return inside(parameters.window.Radius() * 0.99f) != inside(parameters.window.Radius() * 1.01f);
  }
};

// Costs of pixels all over the reference, borders included, with a random plane each.
std::vector<float> SimdCosts(const Scene& scene, std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  const SimdMatcher matcher(scene.input, scene.parameters, scene.relative);
  std::vector<float> all;
  for (int y = 0; y < scene.parameters.reference.height; y += 3) {
    for (int x = 0; x < scene.parameters.reference.width; x += 3) {
      float costs[4];
      for (const Samples samples : {Samples::kAll, Samples::kSparse}) {
        matcher.Costs(matcher.LoadPatch(x, y), x, y, scene.Hypothesis(x, y, 5), samples, costs);
        all.insert(all.end(), costs, costs + 4);
      }
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  return all;
}

double SampleInDouble(const GrayImage& image, double u, double v) {
  const double x = std::clamp(u - 0.5, 0.0, image.width() - 1.0),
               y = std::clamp(v - 0.5, 0.0, image.height() - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
  const double fx = x - x0, fy = y - y0;
  return (1 - fy) * ((1 - fx) * image(x0, y0) + fx * image(x1, y0)) +
         fy * ((1 - fx) * image(x0, y1) + fx * image(x1, y1));
}

// The definition (Eq. 4) in double, mean first. The window must be inside the source.
double CostInDouble(const Scene& scene, int x, int y, const PlaneHypothesis& h, int j, WindowScale scale) {
  const MatchingWindow window = WindowAtScale(scene.parameters.window, scale);
  const Pinhole& k = scene.views[0].camera.pinhole;
  const Camera& to = scene.views[j + 1].camera;
  const Camera& from = scene.views[0].camera;
  const Eigen::Matrix3d rotation = to.pose.rotation * from.pose.rotation.transpose();
  const Eigen::Vector3d translation = to.pose.translation - rotation * from.pose.translation;
  const Eigen::Vector3d normal(h.normal.x, h.normal.y, h.normal.z);
  const auto ray = [&](double u, double v) {
    return Eigen::Vector3d((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1);
  };
  const double offset = h.depth * normal.dot(ray(x + 0.5, y + 0.5));
  std::vector<double> a, b;
  for (int row = -window.samples_per_side; row <= window.samples_per_side; ++row) {
    for (int column = -window.samples_per_side; column <= window.samples_per_side; ++column) {
      const double u = x + 0.5 + column * window.step, v = y + 0.5 + row * window.step;
      const Eigen::Vector3d point = rotation * (offset / normal.dot(ray(u, v)) * ray(u, v)) + translation;
      const Pinhole& s = to.pinhole;
      a.push_back(SampleInDouble(*scene.input.reference.image, u, v));
      b.push_back(SampleInDouble(*scene.input.sources[j].image, s.fx * point.x() / point.z() + s.cx,
                                 s.fy * point.y() / point.z() + s.cy));
    }
  }
  const auto n = static_cast<Eigen::Index>(a.size());
  Eigen::ArrayXd r = Eigen::Map<Eigen::ArrayXd>(a.data(), n), s = Eigen::Map<Eigen::ArrayXd>(b.data(), n);
  const double center = SampleInDouble(*scene.input.reference.image, x + 0.5, y + 0.5);
  const Eigen::ArrayXd w = (-std::log(2.0) * window.weight_decay * (r - center).square()).exp();
  r -= (w * r).sum() / w.sum();
  s -= (w * s).sum() / w.sum();
  return 1 - (w * r * s).sum() / std::sqrt((w * r.square()).sum() * (w * s.square()).sum());
}

// The readable cost rounds whole pixel coordinates, the vectorised one only offsets from the window's centre,
// so it is the closer one to the definition. In noise of full contrast, as here, few samples are like the centre and carry
// the weight: single windows differ, the mean of all does not.
struct Tolerance {
  double readable = 1e-2, mean = 5e-5, definition = 1e-3;
};

void ExpectAgreement(const Scene& scene, Tolerance tolerance) {
  const SimdMatcher simd(scene.input, scene.parameters, scene.relative);
  const ScalarMatcher scalar(scene.input, scene.parameters, scene.relative);
  int matched = 0, rejected = 0;
  double sum = 0;
  for (int y = 0; y < scene.parameters.reference.height; y += 2) {
    for (int x = 0; x < scene.parameters.reference.width; x += 5) {
      const PlaneHypothesis h = scene.Hypothesis(x, y, 7);
      float expected[4], actual[4];
      scalar.Costs(scalar.LoadPatch(x, y), x, y, h, Samples::kAll, expected);
      simd.Costs(simd.LoadPatch(x, y), x, y, h, Samples::kAll, actual);
      for (int j = 0; j < 4; ++j) {
        if (scene.OnTheEdge(x, y, h, j)) continue;
        ++(expected[j] == kMaxCost ? rejected : matched);
        ASSERT_NEAR(actual[j], expected[j], tolerance.readable)
            << "pixel " << x << " " << y << ", view " << j;
        if (expected[j] == kMaxCost) continue;
        sum += std::abs(actual[j] - expected[j]);
        ASSERT_NEAR(actual[j], CostInDouble(scene, x, y, h, j, scalar.LoadPatch(x, y).scale),
                    tolerance.definition)
            << "pixel " << x << " " << y << ", view " << j;
      }
    }
  }
  EXPECT_LT(sum / matched, tolerance.mean);
  EXPECT_GT(matched, 1000);
  EXPECT_GT(rejected, 1000);
}

TEST(SimdMatcher, AgreesWithTheDefinitionAndTheReadableCost) { ExpectAgreement(Scene(), {}); }
TEST(SimdMatcher, AgreesForWindowsOfAnySize) {
  ExpectAgreement(Scene(12, 1), {});  // 625 samples
  // 25 samples, and 9, less than a chunk: in noise hardly more than one is like the centre and has weight, and nothing
  // averages its rounding.
  ExpectAgreement(Scene(2, 1), {2e-2, 1e-3, 1e-3});
  ExpectAgreement(Scene(5, 5), {2e-2, 1e-3, 1e-3});
}

// Contrast grows from the left to the right, so that the narrow window and all levels of the pyramid are in use.
TEST(SimdMatcher, AgreesAtEveryWindowScale) {
  Scene scene(7, 1.4, 3);
  const auto fade = [](ViewImage* view) {
    auto faint = std::make_shared<GrayImage>(*view->image);
    for (int y = 0; y < faint->height(); ++y) {
      for (int x = 0; x < faint->width(); ++x) {
        const double contrast = 0.02 + 0.3 * x / faint->width();
        (*faint)(x, y) = static_cast<std::uint8_t>(std::lround(128 + contrast * ((*faint)(x, y) - 128.0)));
      }
    }
    view->image = faint;
  };
  fade(&scene.input.reference);
  for (ViewImage& source : scene.input.sources) fade(&source);
  const SimdMatcher simd(scene.input, scene.parameters, scene.relative);
  const ScalarMatcher scalar(scene.input, scene.parameters, scene.relative);
  int compared[4] = {0, 0, 0, 0}, on_the_edge = 0, range_steps = 0;  // levels, narrow window
  for (int y = 0; y < scene.parameters.reference.height; y += 2) {
    for (int x = 0; x < scene.parameters.reference.width; x += 2) {
      const PlaneHypothesis h = scene.Hypothesis(x, y, 7);
      const SimdMatcher::Patch patch = simd.LoadPatch(x, y);
      const ScalarMatcher::Patch scalar_patch = scalar.LoadPatch(x, y);
      ASSERT_EQ(patch.scale.level, scalar_patch.scale.level);
      ASSERT_EQ(patch.scale.is_narrow, scalar_patch.scale.is_narrow);
      ASSERT_EQ(patch.scale.range_step, scalar_patch.scale.range_step);
      range_steps |= 1 << patch.scale.range_step;
      float expected[4], actual[4];
      scalar.Costs(scalar_patch, x, y, h, Samples::kAll, expected);
      simd.Costs(patch, x, y, h, Samples::kAll, actual);
      for (int j = 0; j < 4; ++j) {
        if ((expected[j] == kMaxCost) != (actual[j] == kMaxCost)) {
          ++on_the_edge;  // of the source or of the smallest variance: rounding decides
          continue;
        }
        if (expected[j] == kMaxCost) continue;
        ++compared[patch.scale.is_narrow ? 3 : patch.scale.level];
        ASSERT_NEAR(actual[j], expected[j], 1e-3) << "pixel " << x << " " << y << ", view " << j;
      }
    }
  }
  for (int count : compared) EXPECT_GT(count, 100);
  EXPECT_EQ(range_steps & 0x7F, 0x7F);
  EXPECT_LT(on_the_edge, 50);
}

TEST(SimdMatcher, SparseSamplesAgreeWithTheReadableCost) {
  const Scene scene(7, 1.4, 1);
  const SimdMatcher simd(scene.input, scene.parameters, scene.relative);
  const ScalarMatcher scalar(scene.input, scene.parameters, scene.relative);
  EXPECT_EQ(simd.NumSamplesPerWindow(Samples::kAll), 121);
  EXPECT_EQ(simd.NumSamplesPerWindow(Samples::kSparse), 17);
  int matched = 0, unlike_all = 0;
  for (int y = 0; y < scene.parameters.reference.height; y += 2) {
    for (int x = 0; x < scene.parameters.reference.width; x += 5) {
      const PlaneHypothesis h = scene.Hypothesis(x, y, 7);
      const SimdMatcher::Patch patch = simd.LoadPatch(x, y);
      float expected[4], actual[4], all[4];
      scalar.Costs(scalar.LoadPatch(x, y), x, y, h, Samples::kSparse, expected);
      simd.Costs(patch, x, y, h, Samples::kSparse, actual);
      simd.Costs(patch, x, y, h, Samples::kAll, all);
      for (int j = 0; j < 4; ++j) {
        if (scene.OnTheEdge(x, y, h, j)) continue;
        ASSERT_NEAR(actual[j], expected[j], 2e-2) << "pixel " << x << " " << y << ", view " << j;
        // The whole window must be inside.
        EXPECT_TRUE(all[j] < kMaxCost || actual[j] == kMaxCost);
        matched += actual[j] < kMaxCost;
        unlike_all += std::abs(actual[j] - all[j]) > 0.05f;
      }
    }
  }
  EXPECT_GT(matched, 1000);
  EXPECT_GT(unlike_all, matched / 2);
}

TEST(SimdMatcher, LargestWindowFitsThePatch) {
  const SimdWindow window(MatchingWindow{32, 1});
  EXPECT_EQ(window.NumSamples(Samples::kAll), 65 * 65);
  EXPECT_EQ(window.NumSamples(Samples::kSparse), 17);
  for (int n = 1; n <= 32; ++n) {
    EXPECT_LE(SimdWindow(MatchingWindow{n, 1}).dx.size(), static_cast<std::size_t>(kMaxSimdSamples)) << n;
  }
}

// Ranked and then scored, to the bit what all samples at once give; and each sample is read once.
TEST(SimdMatcher, ScoringGoesOnFromRanking) {
  const Scene scene;
  const SimdMatcher matcher(scene.input, scene.parameters, scene.relative);
  int num_read = 0;
  for (int y = 0; y < scene.parameters.reference.height; y += 3) {
    for (int x = 0; x < scene.parameters.reference.width; x += 3) {
      const auto patch = matcher.LoadPatch(x, y);
      const PlaneHypothesis h = scene.Hypothesis(x, y, 5);
      SimdMatcher::Ranked ranked;
      float sparse[4], sparse_alone[4], scored[4], at_once[4];
      const int read_sparse = matcher.Rank(patch, x, y, h, &ranked, sparse), read_rest = matcher.Score(patch, &ranked, scored);
      EXPECT_EQ(read_rest, matcher.Costs(patch, x, y, h, Samples::kAll, at_once));
      EXPECT_EQ(read_sparse, matcher.Costs(patch, x, y, h, Samples::kSparse, sparse_alone));
      EXPECT_EQ(std::memcmp(scored, at_once, sizeof(scored)), 0) << x << ", " << y;
      EXPECT_EQ(std::memcmp(sparse, sparse_alone, sizeof(sparse)), 0) << x << ", " << y;
      num_read += read_rest;
    }
  }
  EXPECT_GT(num_read, 1000);
  EXPECT_EQ(matcher.NumSamplesPerWindow(Samples::kSparse), 17);
  EXPECT_EQ(matcher.NumSamplesPerWindow(Samples::kAll), 121);
}

TEST(SimdMatcher, InstructionSetsWithFusedMultiplyAddAgreeToTheBit) {
  if ((hwy::SupportedTargets() & HWY_AVX2) == 0 || (hwy::SupportedTargets() & HWY_AVX3) == 0) {
    GTEST_SKIP() << "this machine does not have both AVX2 and AVX-512";
  }
  const Scene scene;
  const std::vector<float> avx2 = SimdCosts(scene, HWY_AVX2), avx512 = SimdCosts(scene, HWY_AVX3);
  EXPECT_EQ(std::memcmp(avx2.data(), avx512.data(), avx2.size() * sizeof(float)), 0);
}

TEST(SimdMatcher, OtherInstructionSetsDifferInRoundingOnly) {
  const Scene scene;
  const std::vector<float> best = SimdCosts(scene, 0);
  for (const std::int64_t target : {HWY_SSE4, HWY_SCALAR}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    const std::vector<float> other = SimdCosts(scene, target);
    int differences = 0;
    for (std::size_t i = 0; i < best.size(); ++i) differences += std::abs(best[i] - other[i]) > 1e-5f;
    EXPECT_LE(differences, 1) << hwy::TargetName(target);  // one window may touch the edge of its source
  }
}

TEST(SimdMatcher, MeaninglessPlanesCostTheMaximum) {
  const Scene scene;
  const SimdMatcher matcher(scene.input, scene.parameters, scene.relative);
  const auto patch = matcher.LoadPatch(100, 100);
  const float nan = std::nanf(""), infinity = HUGE_VALF;
  for (const PlaneHypothesis& h :
       {PlaneHypothesis{{0, 0, -1}, nan}, PlaneHypothesis{{nan, 0, -1}, 4}, PlaneHypothesis{{0, 0, 0}, 4},
        PlaneHypothesis{{0, 0, -1}, 0}, PlaneHypothesis{{0, infinity, -1}, 4}}) {
    float costs[4];
    matcher.Costs(patch, 100, 100, h, Samples::kAll, costs);
    for (const float cost : costs) EXPECT_EQ(cost, kMaxCost);
  }
}

}  // namespace
}  // namespace phi
