// The paper's form on the GPU against the CPU's.
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "tests/cuda/cuda_test_fixture.h"
#include "tests/support/exact_scenes.h"

namespace phi::gpu {
namespace {

using test_support::RenderedScene;

class PaperParityTest : public CudaTest {
 protected:
  const std::unique_ptr<Backend> cpu_ = MakeCpuBackend(0);
  std::unique_ptr<Backend> gpu_;

  void SetUp() override {
    CudaTest::SetUp();
    if (!IsSkipped()) gpu_ = std::move(MakeCudaBackends({0}).front());
  }
};

// Sparse points everywhere, in a view whose range ends far behind them: only a disturbance by their depths, not by the view's,
// finds the surface.
EstimationInput InputWithSparsePoints(const RenderedScene& scene) {
  EstimationInput input = MakeInput(scene, 0, 0.5f, 4000);
  const PlaneMap& truth = *scene.truth[0];
  for (int y = 2; y < truth.height(); y += 5) {
    for (int x = 2; x < truth.width(); x += 5) {
      if (truth(x, y).depth > 0) input.sparse.push_back({x + 0.5f, y + 0.5f, truth(x, y).depth});
    }
  }
  return input;
}

TEST_F(PaperParityTest, EstimatesAsTheCpuDoes) {
  const RenderedScene scene = test_support::SphereScene({.noise_sigma = 2});
  StereoOptions options;
  options.method.formulas = Formulas::kPaper;
  options.num_window_levels = 1;
  const EstimationInput input = InputWithSparsePoints(scene);
  const EstimationResult gpu = gpu_->Estimate(input, options), cpu = cpu_->Estimate(input, options);
  for (const double tolerance : {0.01, 0.02, 0.05}) {
    const double cpu_percent = PercentCorrect(cpu.map, *scene.truth[0], tolerance);
    EXPECT_NEAR(PercentCorrect(gpu.map, *scene.truth[0], tolerance), cpu_percent, 0.6)
        << "within " << tolerance;
  }
  EXPECT_GT(PercentCorrect(cpu.map, *scene.truth[0], 0.05), 60);
}

TEST_F(PaperParityTest, FiltersAndInfersAsTheCpuDoes) {
  const RenderedScene scene = test_support::SphereScene();
  PlaneMap holes = *scene.truth[0];
  for (int y = 0; y < holes.height(); ++y) {
    for (int x = 0; x < holes.width(); ++x) {
      if ((x / 14 + y / 10) % 2 == 1) holes(x, y).depth = 0;
    }
  }
  FilterInput filter_input;
  filter_input.reference = {&scene.views[0], std::make_shared<const MeasurementMap>(MeasurementMap{holes, {}})};
  filter_input.sources = scene.SourceTruth(0);
  FilterOptions filter;
  filter.method.formulas = Formulas::kPaper;
  filter.max_depth_error = 0.02;
  MeasurementMap measured = cpu_->Filter(filter_input, filter);
  const PlaneMap on_gpu = gpu_->Filter(filter_input, filter).planes;
  std::size_t num_different = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    num_different += std::memcmp(&measured.planes.data()[i], &on_gpu.data()[i], sizeof(PlaneHypothesis)) != 0;
  }
  EXPECT_LE(num_different, measured.size() / 2000);  // thresholds met within rounding

  for (int y = 0; y < holes.height(); ++y) {
    for (int x = 0; x < holes.width(); ++x) {  // clues are no anchors here
      if (x / 14 % 3 == 1 && IsMeasured(measured.states(x, y))) measured.states(x, y) = PixelState::kClue;
    }
  }
  InferenceInput input;
  input.reference = scene.Image(0);
  input.sources = scene.SourceImages(0);
  input.measured = std::make_shared<const MeasurementMap>(measured);
  for (const InferenceMode mode : {InferenceMode::kMinCost, InferenceMode::kMrf}) {
    InferenceOptions options;
    options.method.formulas = Formulas::kPaper;
    options.mode = mode;
    const InferenceResult gpu = gpu_->Infer(input, StereoOptions(), options);
    const InferenceResult cpu = cpu_->Infer(input, StereoOptions(), options);
    EXPECT_EQ(gpu.statistics.num_nodes, cpu.statistics.num_nodes);
    std::size_t num_filled = 0;
    num_different = 0;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      const float depth = cpu.map.planes.data()[i].depth;
      num_filled += IsInferred(cpu.map.states.data()[i]);
      num_different += std::abs(gpu.map.planes.data()[i].depth - depth) > 1e-3f * depth;
    }
    EXPECT_GT(num_filled, measured.size() / 4);
    EXPECT_LE(num_different, measured.size() / 100);
  }
}

}  // namespace
}  // namespace phi::gpu
