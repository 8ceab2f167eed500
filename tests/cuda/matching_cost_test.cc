// The GPU's matching cost against the readable form, hypothesis by hypothesis.
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "cuda/device_resources.h"
#include "phi/cpu/scalar_matcher.h"
#include "phi/matching/estimation_setup.h"
#include "tests/cuda/cuda_test_fixture.h"
#include "tests/support/exact_scenes.h"

namespace phi::gpu {
namespace {

// As GraySampler, with the fractions rounded to the 8 bits that texture units have.
struct TextureUnitSampler {
  ArrayView2D<const std::uint8_t> image;

  float operator()(float u, float v) const {
    const auto rounded = [](float x) { return std::floor((x - 0.5f) * 256.0f + 0.5f) / 256.0f + 0.5f; };
    return GraySampler{image}(rounded(u), rounded(v));
  }
};

class MatchingCostTest : public CudaTest {
 protected:
  MatchingCostTest() : scene_(test_support::PlaneScene()) {}

  // The exact plane with depth and normal disturbed by up to `disturbance`, relatively.
  PlaneMap Hypotheses(float disturbance) const {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> symmetric(-disturbance, disturbance);
    PlaneMap map = *scene_.truth[0];
    for (PlaneHypothesis& h : map) {
      h.depth *= 1 + symmetric(random);
      const float x = symmetric(random), y = symmetric(random);
      h.normal = Normalized(h.normal + Vec3f{x, y, 0});
    }
    return map;
  }

  // costs[view][pixel]
  std::vector<float> CostsOnGpu(const EstimationInput& input, const EstimationParameters& parameters,
                                const PlaneMap& map, Samples samples = Samples::kAll) {
    const Task task{"test"};
    const Stream stream(task);
    EstimationLaunch launch;
    launch.parameters = parameters;
    launch.end_row = map.height();
    const GrayPyramid reference(*input.reference.image, stream.get(), task);
    reference.CopyTextures(0, launch.reference);
    const DeviceBuffer<std::uint8_t> window_scales(static_cast<std::int64_t>(map.size()), task);
    launch.window_scales = window_scales.View(map.width(), map.height());
    LaunchWindowScales(launch, stream.get(), task);
    std::vector<std::unique_ptr<GrayPyramid>> textures;
    const std::vector<RelativeView> views = MakeRelativeViews(input);
    for (std::size_t j = 0; j < views.size(); ++j) {
      textures.push_back(std::make_unique<GrayPyramid>(*input.sources[j].image, stream.get(), task));
      launch.sources[j] = {views[j].a, views[j].b, views[j].source.width, views[j].source.height, {}};
      textures.back()->CopyTextures(0, launch.sources[j].textures);
    }
    StagingPool staging;
    const DeviceMap hypotheses(map, &staging, task);
    const std::int64_t count = static_cast<std::int64_t>(map.size() * views.size());
    const DeviceBuffer<float> costs(count, task);
    PinnedBuffer<float> host;
    LaunchViewCosts(launch, hypotheses.View(), samples, costs.data(), stream.get(), task);
    host.Download(costs, count, stream.get(), task);
    stream.Synchronize(task);
    return {host.data(), host.data() + count};
  }

  std::vector<float> CostsOnCpu(const EstimationInput& input, const StereoOptions& options,
                                const PlaneMap& map, Samples samples) {
    const EstimationParameters p = MakeEstimationParameters(input, options);
    const std::vector<RelativeView> views = MakeRelativeViews(input);
    const TextureUnitSampler reference{input.reference.image->view()};
    std::vector<float> costs;
    for (std::size_t j = 0; j < views.size(); ++j) {
      const TextureUnitSampler source{input.sources[j].image->view()};
      for (int y = 0; y < map.height(); ++y) {
        for (int x = 0; x < map.width(); ++x) {
          const Vec3f q = InverseDepthCoefficients(p.reference, x + 0.5f, y + 0.5f, map(x, y));
          const WindowScale scale = SelectWindowScale(&reference, 1, p.window, x + 0.5f, y + 0.5f);
          costs.push_back(ZnccCost(reference, source, WindowAtScale(p.window, scale), {x + 0.5f, y + 0.5f},
                                   PlaneHomography(views[j], q), samples));
        }
      }
    }
    return costs;
  }

  void ExpectSameCosts(const StereoOptions& options, float disturbance) {
    for (const Samples samples : {Samples::kAll, Samples::kSparse}) ExpectSameCosts(options, disturbance, samples);
  }

  void ExpectSameCosts(const StereoOptions& options, float disturbance, Samples samples) {
    const EstimationInput input = MakeInput(scene_, 0, 1, 20);
    const PlaneMap map = Hypotheses(disturbance);
    const std::vector<float> gpu = CostsOnGpu(input, MakeEstimationParameters(input, options), map, samples),
                             cpu = CostsOnCpu(input, options, map, samples);
    ASSERT_EQ(gpu.size(), cpu.size());
    std::size_t num_far = 0, num_matched = 0;
    double sum = 0;
    for (std::size_t i = 0; i < gpu.size(); ++i) {
      const double difference = std::abs(gpu[i] - cpu[i]);
      sum += difference;
      num_far += difference > 5e-3;
      num_matched += cpu[i] < kMaxCost;
    }
    EXPECT_GT(num_matched, gpu.size() / 4) << "the scene does not test what it should";
    EXPECT_LT(sum / static_cast<double>(gpu.size()), 5e-4);
    EXPECT_LT(num_far, gpu.size() / 1000);  // windows that touch the border or the variance floor
  }

  test_support::RenderedScene scene_;
};

TEST_F(MatchingCostTest, AgreesNearTheSurface) { ExpectSameCosts(StereoOptions(), 0.01f); }

TEST_F(MatchingCostTest, AgreesForWildHypotheses) { ExpectSameCosts(StereoOptions(), 0.3f); }

TEST_F(MatchingCostTest, AgreesForAWindowThatIsNotCompiledIn) {
  StereoOptions options;
  options.window_radius = 6;
  options.window_step = 2;
  ExpectSameCosts(options, 0.05f);
}

// With a sixteenth of the contrast windows go to coarser levels.
TEST_F(MatchingCostTest, AgreesOnCoarserLevels) {
  for (auto& image : scene_.images) {
    auto faint = std::make_shared<GrayImage>(*image);
    for (std::uint8_t& value : *faint) value = static_cast<std::uint8_t>(128 + (value - 128) / 16);
    image = faint;
  }
  const EstimationInput input = MakeInput(scene_, 0, 1, 20);
  const PlaneMap map = Hypotheses(0.01f);
  EstimationParameters p = MakeEstimationParameters(input, StereoOptions());
  p.num_levels = 3;
  const std::vector<RelativeView> views = MakeRelativeViews(input);
  const ScalarMatcher matcher(input, p, views);
  const std::vector<float> gpu = CostsOnGpu(input, p, map);
  std::size_t num_coarse = 0, num_far = 0;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      float costs[kMaxSourceViews];
      const ScalarMatcher::Patch patch = matcher.LoadPatch(x, y);
      matcher.Costs(patch, x, y, map(x, y), Samples::kAll, costs);
      num_coarse += patch.scale.level > 0;
      for (std::size_t j = 0; j < views.size(); ++j) {
        num_far +=
            std::abs(gpu[j * map.size() + static_cast<std::size_t>(y) * map.width() + x] - costs[j]) > 0.02f;
      }
    }
  }
  EXPECT_GT(num_coarse, map.size() / 4) << "the scene does not test what it should";
  EXPECT_LT(num_far, gpu.size() / 100);
}

TEST_F(MatchingCostTest, IsNearZeroOnTheExactSurface) {
  const EstimationInput input = MakeInput(scene_, 0, 1, 20);
  const std::vector<float> costs =
      CostsOnGpu(input, MakeEstimationParameters(input, StereoOptions()), *scene_.truth[0]);
  std::size_t num_low = 0, num_matched = 0;
  for (const float cost : costs) {
    num_matched += cost < kMaxCost;
    num_low += cost < 0.1f;
  }
  EXPECT_GT(num_low, num_matched * 95 / 100);
  EXPECT_GT(num_matched, costs.size() / 2);
}

}  // namespace
}  // namespace phi::gpu
