// The same test bodies on the CPU and on the GPU, and the GPU's maps against the CPU's.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "cuda/device_map.h"
#include "cuda/filtering_kernels.h"
#include "phi/cpu/cpu_filter.h"
#include "phi/filtering/filter_setup.h"
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

StereoOptions Fast() {
  StereoOptions options;
  options.quality = Quality::kFast;
  return options;
}

// Large enough for two coarser parts, of odd size.
ExactSceneOptions CoarseStartScene() {
  ExactSceneOptions options;
  options.width = 431;
  options.height = 387;
  options.focal = 400;
  options.noise_sigma = 2;
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
  input.reference = {&scene.views[0], std::make_shared<const MeasurementMap>(MeasurementMap{map, {}})};
  input.sources = scene.SourceTruth(0);
  return input;
}

SharingInput SharingInputOf(const RenderedScene& scene, const PlaneMap& map) {
  return {InputOf(scene),
          {&scene.views[0], std::make_shared<const MeasurementMap>(MeasurementMap{map, {}})},
          scene.SourceTruth(0)};
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
  EXPECT_GT(PercentCorrect(result.map, *scene.truth[0], 0.02), 70);
}

TEST_P(BackendTest, FindsASlantedPlaneFromCoarseToFine) {
  const RenderedScene scene = test_support::PlaneScene(CoarseStartScene());
  const EstimationResult result = backend_->Estimate(InputOf(scene), Fast());
  EXPECT_EQ(result.cost.height(), 387);
  EXPECT_GT(PercentCorrect(result.map, *scene.truth[0], 0.01), 90);
  EXPECT_TRUE(SameBytes(result, backend_->Estimate(InputOf(scene), Fast())));
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

// A block that the search missed, in sources that did not miss it.
TEST_P(BackendTest, SharesWhatOtherImagesFound) {
  const RenderedScene scene = test_support::PlaneScene(SmallScene());
  PlaneMap missed = *scene.truth[0];
  for (int y = 30; y < 50; ++y) {
    for (int x = 40; x < 60; ++x) missed(x, y).depth *= 1.1f;
  }
  const PlaneMap shared = backend_->Share(SharingInputOf(scene, missed), StereoOptions())->planes;
  int num_mended = 0;
  for (int y = 0; y < missed.height(); ++y) {
    for (int x = 0; x < missed.width(); ++x) {
      const bool is_mended = std::abs(shared(x, y).depth / (*scene.truth[0])(x, y).depth - 1) < 0.002f;
      const bool is_kept = std::memcmp(&shared(x, y), &missed(x, y), sizeof(PlaneHypothesis)) == 0;
      ASSERT_TRUE(is_mended || is_kept) << x << ' ' << y;
      num_mended += is_mended && !is_kept;
    }
  }
  EXPECT_GT(num_mended, 0.97 * 20 * 20);
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
  const PlaneMap kept = backend_->Filter(FilterInputOf(scene, map), FilterOptions()).planes;
  for (int y = 20; y < 60; ++y) {
    for (int x = 30; x < 70; ++x) (is_wrong(x, y) ? num_kept_false : num_kept_true) += kept(x, y).depth > 0;
  }
  EXPECT_EQ(num_kept_false, 0);
  EXPECT_GT(num_kept_true, 0.99 * (40 * 40 - 20 * 20));
}

// The truth without the pixels of a rectangle that spans several tiles of the field. Across it the plane's inverse depth changes by
// less than a depth edge.
PlaneMap TruthWithHole(const RenderedScene& scene) {
  PlaneMap map = *scene.truth[0];
  for (int y = 15; y < map.height() - 15; ++y) {
    for (int x = 42; x < 54; ++x) map(x, y).depth = 0;
  }
  return map;
}

InferenceInput InferenceInputOf(const RenderedScene& scene, const MeasurementMap& measured) {
  InferenceInput input;
  input.reference = scene.Image(0);
  input.sources = scene.SourceImages(0);
  input.measured = std::make_shared<const MeasurementMap>(measured);
  return input;
}

TEST_P(BackendTest, InfersThePlaneAcrossAHole) {
  const RenderedScene scene = test_support::PlaneScene(SmallScene());
  const MeasurementMap measured = AllMeasured(TruthWithHole(scene));
  for (const InferenceMode mode : {InferenceMode::kMinCost, InferenceMode::kMrf}) {
    InferenceOptions options;
    options.mode = mode;
    const InferenceResult result =
        backend_->Infer(InferenceInputOf(scene, measured), StereoOptions(), options);
    EXPECT_GT(PercentCorrect(result.map.planes, *scene.truth[0], 1e-3), 99);
    std::size_t num_wrong_masks = 0, num_tilted = 0;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      const PlaneHypothesis& h = result.map.planes.data()[i];
      const bool hole = measured.states.data()[i] == PixelState::kNone, filled = h.depth > 0 && hole;
      num_wrong_masks += IsInferred(result.map.states.data()[i]) != filled;
      num_tilted += filled && Dot(h.normal, scene.truth[0]->data()[i].normal) < 0.999f;
    }
    EXPECT_EQ(num_wrong_masks, 0u);
    EXPECT_EQ(num_tilted, 0u);
  }
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

TEST_F(ParityTest, AsManyCorrectPixelsAsTheCpuFromCoarseToFine) {
  const RenderedScene scene = test_support::SphereScene(CoarseStartScene());
  const EstimationResult gpu = MakeBackend("cuda")->Estimate(InputOf(scene), Fast());
  const EstimationResult cpu = MakeBackend("cpu")->Estimate(InputOf(scene), Fast());
  for (const double tolerance : {0.005, 0.01, 0.02}) {
    const double cpu_percent = PercentCorrect(cpu.map, *scene.truth[0], tolerance);
    EXPECT_GT(cpu_percent, 50);
    EXPECT_NEAR(PercentCorrect(gpu.map, *scene.truth[0], tolerance), cpu_percent, 0.3)
        << "within " << tolerance;
  }
}

// Of which the upper half of each source's image is left out.
std::size_t NumKeptWithMasks(const FilterInput& whole, const FilterOptions& options, Backend* backend) {
  FilterInput input = whole;
  auto mask = std::make_shared<ImageMask>(whole.reference.map->width(), whole.reference.map->height(), 255);
  std::fill(mask->data(), mask->data() + mask->size() / 2, std::uint8_t{0});
  for (SourceMap& source : input.sources) source.load_mask = [mask] { return mask; };
  const PlaneMap kept = backend->Filter(input, options).planes;
  return static_cast<std::size_t>(
      std::count_if(kept.begin(), kept.end(), [](const PlaneHypothesis& h) { return h.depth > 0; }));
}

// An early estimate, of which the sources, which carry the truth, offer planes for many pixels. A plane that falls on a pixel's border may
// fall on either side.
TEST_F(ParityTest, SharesAsTheCpuDoes) {
  const RenderedScene scene = test_support::SphereScene();
  const EstimationResult estimate = MakeBackend("cpu")->Estimate(InputOf(scene), Iterations(1));
  const SharingInput input = SharingInputOf(scene, estimate.map);
  const PlaneMap gpu = MakeBackend("cuda")->Share(input, StereoOptions())->planes;
  const PlaneMap cpu = MakeBackend("cpu")->Share(input, StereoOptions())->planes;
  std::size_t num_taken = 0, num_unlike = 0;
  for (std::size_t i = 0; i < cpu.size(); ++i) {
    num_taken += cpu.data()[i].depth != estimate.map.data()[i].depth;
    num_unlike += std::abs(gpu.data()[i].depth / cpu.data()[i].depth - 1) > 1e-3f;
  }
  EXPECT_GT(num_taken, cpu.size() / 10);
  EXPECT_LT(num_unlike, cpu.size() / 500);
}

// Clues too: the photo's own texture, the neighbours' planes and the precision are worked out on the device.
TEST_F(ParityTest, FilterJudgesAsTheCpuDoes) {
  const RenderedScene scene = test_support::SphereScene();
  const EstimationInput estimation = InputOf(scene);
  const EstimationResult estimate = MakeBackend("cpu")->Estimate(estimation, Iterations(3));
  std::vector<const Camera*> sources;
  for (const ViewImage& source : estimation.sources) sources.push_back(&source.view->camera);
  FilterInput input = FilterInputOf(scene, estimate.map);
  std::size_t num_before_the_end = 0;
  for (const float end : {6.0f, std::numeric_limits<float>::infinity()}) {  // of the search: where the wall stands
    input.judgement = {estimation.reference.image, 3, DepthPrecision(estimation.reference.view->camera, sources), end, {}};
    const MeasurementMap gpu = MakeBackend("cuda")->Filter(input, {}), cpu = MakeBackend("cpu")->Filter(input, {});
    std::size_t num_different = 0, num_measured = 0, num_clues = 0;
    for (std::size_t i = 0; i < gpu.size(); ++i) {
      num_different += std::memcmp(&gpu.planes.data()[i], &cpu.planes.data()[i], sizeof(PlaneHypothesis)) != 0 ||
                       gpu.states.data()[i] != cpu.states.data()[i];
      num_measured += cpu.states.data()[i] == PixelState::kMeasured;
      num_clues += cpu.states.data()[i] == PixelState::kClue;
    }
    EXPECT_GT(num_measured, num_before_the_end);
    num_before_the_end = num_measured + cpu.size() / 50;
    if (std::isinf(end)) {
      EXPECT_GT(num_measured, cpu.size() / 10);
      EXPECT_GE(num_clues, 20);
    }
    EXPECT_LE(num_different, cpu.size() / 2000);  // the filter's thresholds met within rounding
  }
}

// What the sources say of an estimate's pixels.
Array2D<Testimonies> TestimoniesOnGpu(const FilterInput& input, const FilterOptions& options) {
  const PlaneMap& estimate = input.reference.map->planes;
  const Task task{"test", "", estimate.width(), estimate.height()};
  const auto num_pixels = static_cast<std::int64_t>(estimate.size());
  const Stream stream(task);
  StagingPool staging;
  const DeviceMap reference(estimate, &staging, task);
  std::vector<DeviceMap> maps;
  for (const SourceMap& source : input.sources) maps.emplace_back(source.load()->planes, &staging, task);
  std::vector<FilterSource> sources;
  for (std::size_t j = 0; j < maps.size(); ++j)
    sources.push_back({MakeRelativeView(input.reference.view->camera, input.sources[j].view->camera), maps[j].View()});
  const DeviceBuffer<FilterSource> device_sources(static_cast<std::int64_t>(sources.size()), task);
  staging.Upload(sources.data(), static_cast<std::int64_t>(sources.size()), device_sources.data(), task);
  const DeviceBuffer<Testimonies> said(num_pixels, task);
  ClearOnDevice(said.data(), num_pixels, stream.get(), task);
  FilterLaunch launch{MakeFilterReference(input, options), {device_sources.data(), static_cast<int>(sources.size())}};
  launch.reference.map = reference.View();
  LaunchAskSources(launch, said.View(estimate.width(), estimate.height()), stream.get(), task);
  Array2D<Testimonies> on_host(estimate.width(), estimate.height());
  CopyToHost(on_host.data(), said.data(), num_pixels, stream.get(), task);
  stream.Synchronize(task);
  return on_host;
}

void ExpectTheSameTestimonies(const FilterInput& input, const FilterOptions& options) {
  Array2D<Testimonies> cpu;
  FilterOnCpu(input, options, &cpu);
  const Array2D<Testimonies> gpu = TestimoniesOnGpu(input, options);
  ASSERT_EQ(cpu.size(), gpu.size());
  const auto num_unlike = [&](auto count) {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < cpu.size(); ++i) sum += gpu.data()[i].*count != cpu.data()[i].*count;
    return sum;
  };
  EXPECT_LE(num_unlike(&Testimonies::num_confirming), cpu.size() / 1000);
  EXPECT_LE(num_unlike(&Testimonies::num_close), cpu.size() / 1000);
  EXPECT_LE(num_unlike(&Testimonies::num_contradicting), cpu.size() / 1000);
  EXPECT_LE(num_unlike(&Testimonies::num_empty), cpu.size() / 1000);
}

TEST_F(ParityTest, FilterDecidesAsTheCpuDoes) {
  const RenderedScene scene = test_support::SphereScene();
  const EstimationResult estimate = MakeBackend("cpu")->Estimate(InputOf(scene), Iterations(3));
  FilterInput input = FilterInputOf(scene, estimate.map);
  input.cost = std::make_shared<const CostMap>(estimate.cost);
  StateMap states(estimate.map.width(), estimate.map.height(), PixelState::kMeasured);
  for (int x = 0; x < states.width(); ++x) states(x, 40) = PixelState::kInferredConfirmed;
  FilterOptions options;
  options.min_ncc = 0.5;
  options.min_triangulation_angle = 1;
  for (const bool after_inference : {false, true}) {
    MeasurementMap map{estimate.map, {}};
    if (after_inference) map.states = states;
    input.reference.map = std::make_shared<const MeasurementMap>(std::move(map));
    const MeasurementMap gpu = MakeBackend("cuda")->Filter(input, options);
    const MeasurementMap cpu = MakeBackend("cpu")->Filter(input, options);
    std::size_t num_different = 0, num_kept = 0;
    for (std::size_t i = 0; i < gpu.size(); ++i) {
      num_different +=
          std::memcmp(&gpu.planes.data()[i], &cpu.planes.data()[i], sizeof(PlaneHypothesis)) != 0 ||
          gpu.states.data()[i] != cpu.states.data()[i];
      num_kept += cpu.states.data()[i] != PixelState::kNone;
    }
    EXPECT_GT(num_kept, cpu.size() / 4);
    EXPECT_LE(num_different, cpu.size() / 2000);  // thresholds met within rounding
    if (!after_inference) ExpectTheSameTestimonies(input, options);
    const std::size_t with_masks = NumKeptWithMasks(input, options, MakeBackend("cpu").get());
    // After inference measured pixels are not asked again.
    if (!after_inference) {
      EXPECT_LT(with_masks, num_kept * 3 / 4);
    }
    EXPECT_NEAR(NumKeptWithMasks(input, options, MakeBackend("cuda").get()), with_masks,
                static_cast<double>(cpu.size()) / 2000);
  }
}

// Energies are integers, so a field solved on the GPU is the CPU's field; costs differ by what the texture units round.
TEST_F(ParityTest, InferenceFillsAsTheCpuDoes) {
  const RenderedScene scene = test_support::SphereScene();
  MeasurementMap measured = AllMeasured(*scene.truth[0]);
  for (int y = 0; y < measured.height(); ++y) {
    for (int x = 0; x < measured.width(); ++x) {
      PixelState& state = measured.states(x, y);
      if (state == PixelState::kNone) continue;
      if (x / 14 % 3 == 1) state = PixelState::kClue;
      if ((x / 14 + y / 10) % 2 == 1) measured.Drop(static_cast<std::size_t>(y) * measured.width() + x);
    }
  }
  const InferenceInput input = InferenceInputOf(scene, measured);
  for (const int num_passes : {1, 3}) {
    InferenceOptions options;
    options.num_passes = num_passes;
    const InferenceResult gpu = MakeBackend("cuda")->Infer(input, StereoOptions(), options);
    const InferenceResult cpu = MakeBackend("cpu")->Infer(input, StereoOptions(), options);
    EXPECT_EQ(gpu.statistics.num_nodes, cpu.statistics.num_nodes);
    EXPECT_GT(cpu.statistics.num_nodes, 1000);
    EXPECT_NEAR(gpu.statistics.energy, cpu.statistics.energy, 2e-3 * cpu.statistics.energy);
    EXPECT_NEAR(gpu.statistics.lower_bound, cpu.statistics.lower_bound, 2e-3 * cpu.statistics.energy);
    EXPECT_NEAR(gpu.statistics.min_cost_energy, cpu.statistics.min_cost_energy,
                2e-3 * cpu.statistics.min_cost_energy);
    EXPECT_LE(gpu.statistics.lower_bound, gpu.statistics.energy);
    EXPECT_EQ(gpu.statistics.num_without_hypothesis, cpu.statistics.num_without_hypothesis);
    EXPECT_NEAR(gpu.statistics.num_unlike_min_cost, cpu.statistics.num_unlike_min_cost,
                5e-3 * cpu.statistics.num_nodes);
    std::size_t num_different = 0, num_filled = 0;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      const float depth = cpu.map.planes.data()[i].depth;
      num_filled += IsInferred(cpu.map.states.data()[i]);
      num_different += std::abs(gpu.map.planes.data()[i].depth - depth) > 1e-3f * depth ||
                       IsInferred(gpu.map.states.data()[i]) != IsInferred(cpu.map.states.data()[i]);
    }
    EXPECT_GT(num_filled, measured.size() / 4);
    EXPECT_LE(num_different, measured.size() / 200);
  }
}

}  // namespace
}  // namespace phi::gpu
