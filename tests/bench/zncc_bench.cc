// ZNCC samples per second and core: one sample is one warped, bilinearly interpolated pixel of one window.
//
// smooth: neighbouring pixels have neighbouring planes, as late in an estimation. random: every evaluation
// has its own depth and normal, as in initialisation. Windows that leave a source image cost next to nothing
// and do not count.
#include <benchmark/benchmark.h>
#include <hwy/targets.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "phi/cpu/scalar_matcher.h"
#include "phi/cpu/simd_matcher.h"
#include "phi/matching/estimation_setup.h"
#include "phi/matching/random_hypothesis.h"

namespace phi {
namespace {

constexpr int kWidth = 3072, kHeight = 2048, kNumViews = 8;
constexpr float kDepth = 5;

std::shared_ptr<const GrayImage> NoiseImage(int seed) {
  auto image = std::make_shared<GrayImage>(kWidth, kHeight);
  std::mt19937 random(seed);
  for (auto& pixel : *image) pixel = static_cast<std::uint8_t>(random() >> 24);
  return image;
}

// Eight cameras on a ring of radius 0.5 around the reference, looking the same way.
struct Setup {
  std::vector<SceneView> views;
  EstimationInput input;
  EstimationParameters parameters;
  std::vector<RelativeView> relative;

  Setup() : views(kNumViews + 1) {
    for (int k = 0; k <= kNumViews; ++k) {
      views[k].image_id = k + 1;
      views[k].camera.pinhole = {kWidth, kHeight, 2800, 2800, kWidth / 2, kHeight / 2};
      if (k > 0) views[k].camera.pose.translation = {0.5 * std::cos(0.785 * k), 0.5 * std::sin(0.785 * k), 0};
    }
    input.reference = {&views[0], NoiseImage(0)};
    for (int k = 1; k <= kNumViews; ++k) input.sources.push_back({&views[k], NoiseImage(k)});
    input.depth_min = 0.5f * kDepth;
    input.depth_max = 2 * kDepth;
    parameters = MakeEstimationParameters(input, StereoOptions());
    relative = MakeRelativeViews(input);
  }
};

const Setup& SharedSetup() {
  static const Setup setup;
  return setup;
}

enum class Planes { kSmooth, kRandom };

// Pixels whose matches stay inside all sources, in scan order; several hypotheses for each, as an iteration
// has.
constexpr int kHypothesesPerPixel = 8, kPixels = 4096;

std::vector<PlaneHypothesis> MakeHypotheses(const Setup& setup, Planes planes) {
  std::vector<PlaneHypothesis> hypotheses;
  for (int i = 0; i < kPixels * kHypothesesPerPixel; ++i) {
    PlaneHypothesis h = {{0.2f, -0.1f, -0.97f}, kDepth * (1 + 1e-6f * static_cast<float>(i % 1000))};
    if (planes == Planes::kRandom) {
      const RayModel& k = setup.parameters.reference;
      h = RandomHypothesis(k, i % k.width, i / k.width, {0.8f * kDepth, 1.5f * kDepth}, {1, 2}, Formulas::kRobust);
    }
    h.normal = Normalized(h.normal);
    hypotheses.push_back(h);
  }
  return hypotheses;
}

template <class Matcher>
void Run(benchmark::State& state, Planes planes) {
  const Setup& setup = SharedSetup();
  const Matcher matcher(setup.input, setup.parameters, setup.relative);
  const std::vector<PlaneHypothesis> hypotheses = MakeHypotheses(setup, planes);
  std::int64_t windows = 0;
  for (auto _ : state) {
    for (int i = 0; i < kPixels; ++i) {
      const int x = 700 + i % 1500, y = 700 + i / 1500;
      const auto patch = matcher.LoadPatch(x, y);
      for (int k = 0; k < kHypothesesPerPixel; ++k) {
        float costs[kNumViews];
        matcher.Costs(patch, x, y, hypotheses[i * kHypothesesPerPixel + k], Samples::kAll, costs);
        for (const float cost : costs) windows += cost < kMaxCost;
        benchmark::DoNotOptimize(costs);
      }
    }
  }
  state.SetItemsProcessed(windows * setup.parameters.window.NumSamples());
  state.counters["inside"] = static_cast<double>(windows) / (static_cast<double>(state.iterations()) *
                                                             kPixels * kHypothesesPerPixel * kNumViews);
}

template <class Matcher>
void Register(const std::string& name, std::int64_t target) {
  for (const Planes planes : {Planes::kSmooth, Planes::kRandom}) {
    const std::string full = "zncc/" + name + (planes == Planes::kSmooth ? "/smooth" : "/random");
    benchmark::RegisterBenchmark(full.c_str(), [planes, target](benchmark::State& state) {
      hwy::SetSupportedTargetsForTest(target);
      Run<Matcher>(state, planes);
      hwy::SetSupportedTargetsForTest(0);
    })->Unit(benchmark::kMillisecond);
  }
}

const bool kRegistered = [] {
  Register<ScalarMatcher>("scalar", 0);
  for (const std::int64_t target : {HWY_SSE4, HWY_AVX2, HWY_AVX3, HWY_NEON}) {
    if (hwy::SupportedTargets() & target) Register<SimdMatcher>(hwy::TargetName(target), target);
  }
  return true;
}();

}  // namespace
}  // namespace phi
