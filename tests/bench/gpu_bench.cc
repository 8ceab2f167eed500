// Device time of the GPU passes on a synthetic scene at 3072x2048 with 8 source views.
//   gpu_bench --benchmark_repetitions=5
// Reports device seconds (CUDA events around the kernels), ZNCC samples/s, and pixels/s of the filter. Ends without
// figures where there is no GPU.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "cuda/calls_on_gpu.h"
#include "cuda/cuda_backend.h"
#include "cuda/fetch_rate.h"
#include "cuda/memory_plan.h"

namespace phi::gpu {
namespace {

constexpr int kWidth = 3072, kHeight = 2048, kNumViews = 9;
constexpr double kFocal = 2700, kDepth = 5;  // pixels, world units

// A textured fronto-parallel wall, seen by cameras that moved sideways by whole pixels' worth of parallax.
struct Wall {
  std::vector<SceneView> views;
  std::vector<std::shared_ptr<const GrayImage>> images;
  std::shared_ptr<const PlaneMap> truth;

  Wall() {
    for (int i = 0; i < kNumViews; ++i) {
      const int shift_x = 40 * ((i + 1) / 2) * (i % 2 == 0 ? 1 : -1), shift_y = 25 * (i % 3 - 1);
      SceneView view;
      view.name = "wall " + std::to_string(i);
      view.image_id = static_cast<std::uint32_t>(i + 1);
      view.camera.pinhole = {kWidth, kHeight, kFocal, kFocal, 0.5 * kWidth, 0.5 * kHeight};
      view.camera.pose.translation = Eigen::Vector3d(shift_x, i == 0 ? 0 : shift_y, 0) * (kDepth / kFocal);
      views.push_back(view);
      images.push_back(Paint(shift_x, i == 0 ? 0 : shift_y));
    }
    PlaneHypothesis plane;
    plane.normal = {0, 0, -1};
    plane.depth = kDepth;
    truth = std::make_shared<const PlaneMap>(kWidth, kHeight, plane);
  }

  static std::shared_ptr<const GrayImage> Paint(int shift_x, int shift_y) {
    auto image = std::make_shared<GrayImage>(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const float u = static_cast<float>(x - shift_x), v = static_cast<float>(y - shift_y);
        (*image)(x, y) =
            static_cast<std::uint8_t>(128 + 40 * std::sin(0.31f * u + 0.17f * v) +
                                      35 * std::cos(0.23f * v - 0.11f * u) + 25 * std::sin(0.0007f * u * v));
      }
    }
    return image;
  }

  std::vector<ViewImage> Sources() const {
    std::vector<ViewImage> sources;
    for (int i = 1; i < kNumViews; ++i) sources.push_back({&views[i], images[i]});
    return sources;
  }
};

const Wall& TheWall() {
  static const Wall wall;
  return wall;
}

// Nothing where there is no GPU; the benchmark then says why.
std::unique_ptr<DeviceResources> Device(benchmark::State* state, std::int64_t budget_bytes = 0) {
  std::string why_none;
  if (NumCudaDevices(&why_none) == 0) {
    state->SkipWithError(why_none.c_str());
    return nullptr;
  }
  return std::make_unique<DeviceResources>(QueryDevice(0), budget_bytes);
}

// Runs call() once per iteration and reports the device time that it added to `kind`.
template <class Call>
void Measure(benchmark::State* state, DeviceResources* device, CallKind kind, const Call& call) {
  call();  // uploads, allocations
  double before = device->times.Of(kind).BusySeconds();
  for (auto _ : *state) {
    call();
    const double now = device->times.Of(kind).BusySeconds();
    state->SetIterationTime(now - before);
    before = now;
  }
}

EstimationInput WallInput() {
  EstimationInput input;
  input.reference = {&TheWall().views[0], TheWall().images[0]};
  input.sources = TheWall().Sources();
  input.depth_min = 0.5 * kDepth;
  input.depth_max = 2 * kDepth;
  return input;
}

void RunEstimation(benchmark::State* state, std::int64_t budget_bytes) {
  const auto device = Device(state, budget_bytes);
  if (!device) return;
  StereoOptions options;
  options.num_iterations = static_cast<int>(state->range(0));
  const EstimationInput input = WallInput();
  Measure(state, device.get(), CallKind::kEstimation,
          [&] { EstimateOnGpu(device.get(), input, options); });
  const KindTime& time = device->times.Of(CallKind::kEstimation);
  state->counters["samples/s"] = time.samples() / time.BusySeconds();
  state->counters["share of bare fetches"] = time.samples() / time.BusySeconds() / MeasureFetchRate();
  state->counters["device MB"] = 1e-6 * static_cast<double>(device->peak_bytes);
}

void BM_Estimation(benchmark::State& state) { RunEstimation(&state, 0); }
BENCHMARK(BM_Estimation)->Arg(1)->Arg(8)->UseManualTime()->Iterations(3)->Unit(benchmark::kMillisecond);

// Too little memory for the whole state.
void BM_EstimationInBands(benchmark::State& state) {
  RunEstimation(&state, EstimationBytes(WallInput()) / 2);
}
BENCHMARK(BM_EstimationInBands)->Arg(8)->UseManualTime()->Iterations(3)->Unit(benchmark::kMillisecond);

// The ceiling: bilinear samples/s of a kernel that only fetches.
void BM_BareFetches(benchmark::State& state) {
  const auto device = Device(&state);
  if (!device) return;
  double rate = 0;
  for (auto _ : state) rate = std::max(rate, MeasureFetchRate());
  state.counters["samples/s"] = rate;
}
BENCHMARK(BM_BareFetches)->Iterations(3)->Unit(benchmark::kMillisecond);

void BM_Filter(benchmark::State& state) {
  const auto device = Device(&state);
  if (!device) return;
  const Wall& wall = TheWall();
  FilterInput input;
  const auto estimate = [&] {
    return std::make_shared<const MeasurementMap>(MeasurementMap{*wall.truth, {}});
  };
  input.reference = {&wall.views[0], estimate()};
  for (int i = 1; i < kNumViews; ++i) {
    const auto map = estimate();
    input.sources.push_back({&wall.views[i], [map] { return map; }});
  }
  Measure(&state, device.get(), CallKind::kFilter,
          [&] { FilterOnGpu(device.get(), input, FilterOptions()); });
}
BENCHMARK(BM_Filter)->UseManualTime()->Iterations(5)->Unit(benchmark::kMillisecond);

// A third of the image is holes.
void BM_Inference(benchmark::State& state) {
  const auto device = Device(&state);
  if (!device) return;
  const Wall& wall = TheWall();
  PlaneMap holes = *wall.truth;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (x / 96 % 3 == 0) holes(x, y).depth = 0;
    }
  }
  const auto measured = std::make_shared<const MeasurementMap>(AllMeasured(holes));
  InferenceInput input;
  input.reference = {&wall.views[0], wall.images[0]};
  input.sources = wall.Sources();
  input.measured = measured;
  Measure(&state, device.get(), CallKind::kInference,
          [&] { InferOnGpu(device.get(), input, StereoOptions(), InferenceOptions()); });
}
BENCHMARK(BM_Inference)->UseManualTime()->Iterations(3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace phi::gpu
