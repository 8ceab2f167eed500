// The same test bodies on the CPU and on the GPU, and the GPU's maps against the CPU's.
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/cuda/cuda_test_fixture.h"
#include "tests/support/exact_scenes.h"

namespace phi::gpu {
namespace {

using test_support::ExactSceneOptions;
using test_support::RenderedScene;

std::unique_ptr<Backend> MakeBackend(const std::string& name) {
  return name == "cpu" ? MakeCpuBackend(0) : std::move(MakeCudaBackends({0}).front());
}

StereoOptions Iterations(int count) {
  StereoOptions options;
  options.num_iterations = count;
  return options;
}

ExactSceneOptions SmallScene() {
  ExactSceneOptions options;
  options.width = 100;
  options.height = 80;
  options.focal = 95;
  return options;
}

EstimationInput InputOf(const RenderedScene& scene) { return MakeInput(scene, 0, 2, 10); }

FilterInput FilterInputOf(const RenderedScene& scene, const PlaneMap& map) {
  FilterInput input;
  input.reference = {&scene.views[0], std::make_shared<const PlaneMap>(map)};
  input.sources = scene.SourceTruth(0);
  return input;
}

bool SameBytes(const EstimationResult& a, const EstimationResult& b) {
  return std::memcmp(a.map.data(), b.map.data(), a.map.bytes()) == 0 &&
         std::memcmp(a.cost.data(), b.cost.data(), a.cost.bytes()) == 0;
}

class BackendTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    std::string why_none;
    if (GetParam() == "cuda" && NumCudaDevices(&why_none) == 0) GTEST_SKIP() << why_none;
    backend_ = MakeBackend(GetParam());
  }

  std::unique_ptr<Backend> backend_;
};

TEST_P(BackendTest, FindsASlantedPlane) {
  const RenderedScene scene = test_support::PlaneScene(SmallScene());
  const EstimationResult result = backend_->Estimate(InputOf(scene), Iterations(4));
  EXPECT_GT(PercentCorrect(result.map, *scene.truth[0], 0.02), 80);
}

TEST_P(BackendTest, RepeatsByteForByteForASeed) {
  const RenderedScene scene = test_support::SphereScene(SmallScene());
  StereoOptions options = Iterations(1);
  const EstimationResult first = backend_->Estimate(InputOf(scene), options);
  EXPECT_TRUE(SameBytes(first, backend_->Estimate(InputOf(scene), options)));
  options.seed = 1;
  EXPECT_FALSE(SameBytes(first, backend_->Estimate(InputOf(scene), options)));
}

TEST_P(BackendTest, ConcurrentCallsGiveTheSameBytes) {
  const RenderedScene scene = test_support::SphereScene(SmallScene());
  const EstimationResult alone = backend_->Estimate(InputOf(scene), Iterations(1));
  std::vector<EstimationResult> results(3);
  std::vector<std::thread> threads;
  for (EstimationResult& result : results) {
    threads.emplace_back([&] { result = backend_->Estimate(InputOf(scene), Iterations(1)); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const EstimationResult& result : results) EXPECT_TRUE(SameBytes(alone, result));
}

TEST_P(BackendTest, StartsFromAnEarlierMapWithTheSourcesGuidance) {
  const RenderedScene scene = test_support::PlaneScene(SmallScene());
  EstimationInput input = InputOf(scene);
  input.initial = scene.truth[0];
  for (std::size_t j = 1; j < scene.views.size(); ++j) input.source_maps.push_back(scene.truth[j]);
  const EstimationResult result = backend_->Estimate(input, Iterations(1));
  EXPECT_GT(PercentCorrect(result.map, *scene.truth[0], 0.01), 97);
}

TEST_P(BackendTest, FilterKeepsTheTruthAndDropsWhatContradictsIt) {
  const RenderedScene scene = test_support::PlaneScene(SmallScene());
  PlaneMap map = *scene.truth[0];
  const auto is_wrong = [](int x, int y) { return x >= 40 && x < 60 && y >= 30 && y < 50; };
  int num_kept_true = 0, num_kept_false = 0;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      if (is_wrong(x, y)) map(x, y).depth *= 1.2f;
    }
  }
  const PlaneMap kept = backend_->Filter(FilterInputOf(scene, map), FilterOptions());
  for (int y = 20; y < 60; ++y) {
    for (int x = 30; x < 70; ++x) (is_wrong(x, y) ? num_kept_false : num_kept_true) += kept(x, y).depth > 0;
  }
  EXPECT_EQ(num_kept_false, 0);
  EXPECT_GT(num_kept_true, 0.99 * (40 * 40 - 20 * 20));
}

INSTANTIATE_TEST_SUITE_P(Backends, BackendTest, testing::Values("cpu", "cuda"),
                         [](const auto& info) { return info.param; });

class ParityTest : public CudaTest {};

TEST_F(ParityTest, AsManyCorrectPixelsAsTheCpu) {
  ExactSceneOptions options;
  options.noise_sigma = 2;
  for (const RenderedScene& scene : {test_support::PlaneScene(options), test_support::SphereScene(options)}) {
    const EstimationResult gpu = MakeBackend("cuda")->Estimate(InputOf(scene), Iterations(6));
    const EstimationResult cpu = MakeBackend("cpu")->Estimate(InputOf(scene), Iterations(6));
    for (const double tolerance : {0.01, 0.02, 0.05}) {
      const double gpu_percent = PercentCorrect(gpu.map, *scene.truth[0], tolerance);
      const double cpu_percent = PercentCorrect(cpu.map, *scene.truth[0], tolerance);
      EXPECT_NEAR(gpu_percent, cpu_percent, 0.3) << "within " << tolerance;
    }
  }
}

TEST_F(ParityTest, FilterDecidesAsTheCpuDoes) {
  const RenderedScene scene = test_support::SphereScene();
  const EstimationResult estimate = MakeBackend("cpu")->Estimate(InputOf(scene), Iterations(3));
  FilterInput input = FilterInputOf(scene, estimate.map);
  input.cost = std::make_shared<const CostMap>(estimate.cost);
  auto filled = std::make_shared<Mask>(estimate.map.width(), estimate.map.height());
  for (int x = 0; x < filled->width(); ++x) (*filled)(x, 40) = 255;
  input.filled = filled;
  FilterOptions options;
  options.max_cost = 0.5;
  options.min_triangulation_angle = 1;
  const PlaneMap gpu = MakeBackend("cuda")->Filter(input, options);
  const PlaneMap cpu = MakeBackend("cpu")->Filter(input, options);
  std::size_t num_different = 0, num_kept = 0;
  for (std::size_t i = 0; i < gpu.size(); ++i) {
    num_different += std::memcmp(&gpu.data()[i], &cpu.data()[i], sizeof(PlaneHypothesis)) != 0;
    num_kept += cpu.data()[i].depth > 0;
  }
  EXPECT_GT(num_kept, cpu.size() / 4);
  EXPECT_LE(num_different, cpu.size() / 2000);  // thresholds met within rounding
}

}  // namespace
}  // namespace phi::gpu
