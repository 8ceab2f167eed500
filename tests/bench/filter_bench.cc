// The rules of the filter that run on the host, one thread, on an image of 6 megapixels.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "phi/base/image_noise.h"
#include "phi/filtering/judge_measurements.h"
#include "phi/filtering/neighbor_planes.h"
#include "phi/filtering/own_texture.h"
#include "phi/geometry/depth_precision.h"

namespace {

constexpr int kWidth = 3072, kHeight = 2048;
constexpr phi::RayModel kRays{
    .fx = 2500, .fy = 2500, .cx = 1536, .cy = 1024, .width = kWidth, .height = kHeight};

// A slanted plane with noise of 0.2 %, three pixels in ten without depth.
phi::PlaneMap NoisyPlane() {
  const phi::Vec3f normal{0.6f, 0, -0.8f};
  std::mt19937 random(1);
  std::uniform_real_distribution<float> noise(-0.002f, 0.002f);
  std::bernoulli_distribution has_depth(0.7);
  phi::PlaneMap map(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float depth = -2 / phi::Dot(normal, kRays.Ray(x + 0.5f, y + 0.5f)) * (1 + noise(random));
      map(x, y) = {normal, has_depth(random) ? depth : 0};
    }
  }
  return map;
}

// Eight source views on a circle around the reference.
phi::DepthPrecision Precision() {
  phi::Camera reference;
  reference.pinhole = {kWidth, kHeight, 2500, 2500, 1536, 1024};
  std::vector<phi::RelativeView> sources;
  for (int k = 0; k < 8; ++k) {
    phi::Camera source = reference;
    source.pose.translation = {0.3 * std::cos(k), 0.3 * std::sin(k), 0};
    sources.push_back(phi::MakeRelativeView(reference, source));
  }
  return {kRays, std::move(sources)};
}

void NeighborCounts(benchmark::State& state) {
  const phi::DepthPrecision precision = Precision();
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const phi::PlaneMap planes = NoisyPlane();
  const phi::Mask all(kWidth, kHeight, 255);
  for (auto _ : state) {
    phi::ForNeighborCounts(kRays, planes, all, precision.RelativeDeviations(planes, all), 1,
                           [](int, const std::vector<std::int32_t>& counts) { benchmark::DoNotOptimize(counts.data()); });
  }
}
BENCHMARK(NeighborCounts)->Unit(benchmark::kMillisecond);

// Every pixel has depth; the image is noise, plain in its right half.
void OwnTexture(benchmark::State& state) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const phi::MeasurementMap map = phi::AllMeasured(phi::PlaneMap(kWidth, kHeight, {{0, 0, -1}, 3}));
  phi::GrayImage image(kWidth, kHeight, 128);
  std::mt19937 random(1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 2; ++x) image(x, y) = static_cast<std::uint8_t>(100 + random() % 50);
  }
  for (auto _ : state) {
    state.PauseTiming();
    phi::MeasurementMap kept = map;
    state.ResumeTiming();
    phi::DropPlainPixels(phi::FindOwnTexture(image, phi::NoiseDeviation(image.view())), &kept);
    benchmark::DoNotOptimize(kept.planes.data());
  }
}
BENCHMARK(OwnTexture)->Unit(benchmark::kMillisecond);

// All that the judgement of an image costs.
void Judgement(benchmark::State& state) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const phi::PlaneMap estimate = NoisyPlane();
  phi::MeasurementMap map = phi::AllMeasured(estimate);
  const phi::Array2D<phi::Testimonies> testimonies(kWidth, kHeight, {5, 4, 2});
  phi::GrayImage image(kWidth, kHeight);
  std::mt19937 random(1);
  for (std::uint8_t& value : image) value = static_cast<std::uint8_t>(100 + random() % 50);
  const phi::Judgement judgement{.image = std::make_shared<const phi::GrayImage>(image), .noise = 1, .precision = Precision()};
  for (auto _ : state) {
    state.PauseTiming();
    phi::MeasurementMap judged = map;
    state.ResumeTiming();
    phi::JudgeMeasurements(judgement, estimate, testimonies, &judged);
    benchmark::DoNotOptimize(judged.planes.data());
  }
}
BENCHMARK(Judgement)->Unit(benchmark::kMillisecond);

}  // namespace
