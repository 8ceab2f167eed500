// Regions of an image and their planes, which the host finds beside the card: one thread, an image of 6 megapixels.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <cstdint>
#include <memory>
#include <random>

#include "phi/inference/image_regions.h"
#include "phi/inference/region_planes.h"

namespace {

constexpr int kWidth = 3072, kHeight = 2048, kTile = 256;

// Tiles of even colours with texture between them.
phi::GrayImage TiledImage() {
  std::mt19937 random(1);
  phi::GrayImage image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool is_even = x % kTile < 200 && y % kTile < 200;
      const int tile = x / kTile + 5 * (y / kTile);
      image(x, y) = static_cast<std::uint8_t>(is_even ? 80 + 37 * tile % 100 : 60 + random() % 100);
    }
  }
  return image;
}

float Depth(int x, int y, float noise) { return (3 + 0.0004f * static_cast<float>(x) + 0.0002f * static_cast<float>(y)) * (1 + noise); }

// Of a slope with noise, everywhere but in the tiles' inside, where one in ten has a depth.
phi::MeasuredDepths RimDepths() {
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.001f);
  phi::DepthMap depths(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool is_inside = x % kTile > 12 && x % kTile < 188 && y % kTile > 12 && y % kTile < 188;
      if (!is_inside || random() % 10 == 0) depths(x, y) = Depth(x, y, noise(random));
    }
  }
  return phi::AllMeasured(std::move(depths));
}

phi::DepthPrecision Precision() {
  phi::Camera reference;
  reference.pinhole = {kWidth, kHeight, 2500, 2500, 1536, 1024};
  std::vector<phi::Camera> sources(6, reference);
  std::vector<const phi::Camera*> views;
  for (std::size_t k = 0; k < sources.size(); ++k) {
    sources[k].pose.translation = {0.1 * static_cast<double>(k) - 0.2, 0.2, 0};
    views.push_back(&sources[k]);
  }
  return {reference, views};
}

// What other views measured: every second pixel of the tiles' inside.
std::vector<phi::PooledAnchor> Pooled(const phi::ImageRegions& regions) {
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0, 0.001f);
  std::vector<phi::PooledAnchor> pooled;
  for (int y = 0; y < kHeight; y += 2) {
    for (int x = 0; x < kWidth; x += 2) {
      if (regions.region(x, y) < 0) continue;
      const float u = static_cast<float>(x) + 0.3f, v = static_cast<float>(y) + 0.2f;
      pooled.push_back({u, v, 1 / Depth(x, y, noise(random)), static_cast<std::uint32_t>(random())});
    }
  }
  return pooled;
}

void Regions(benchmark::State& state) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const phi::GrayImage image = TiledImage();
  for (auto _ : state) benchmark::DoNotOptimize(phi::FindRegions(image).num_regions);
}
BENCHMARK(Regions)->Unit(benchmark::kMillisecond);

void PlanesTold(benchmark::State& state) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const auto regions = std::make_shared<const phi::ImageRegions>(phi::FindRegions(TiledImage()));
  const phi::MeasuredDepths depths = RimDepths();
  const phi::DepthPrecision precision = Precision();
  for (auto _ : state) benchmark::DoNotOptimize(phi::FindViewRegions(regions, depths, 1, precision, {}).regions.size());
}
BENCHMARK(PlanesTold)->Unit(benchmark::kMillisecond);

void PlanesWithPooledAnchors(benchmark::State& state) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const auto regions = std::make_shared<const phi::ImageRegions>(phi::FindRegions(TiledImage()));
  const phi::MeasuredDepths depths = RimDepths();
  phi::Array2D<float> anchors(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) anchors(x, y) = depths.depths(x, y) > 0 ? 1 / depths.depths(x, y) : 0;
  }
  phi::PlaneEvidence evidence;
  evidence.precision = Precision();
  evidence.pooled = Pooled(*regions);
  const phi::ArrayView2D<const float> view = std::as_const(anchors).view();
  for (auto _ : state) benchmark::DoNotOptimize(phi::RegionPlanes(regions, view, 1, evidence).At(100, 100)[0].a);
}
BENCHMARK(PlanesWithPooledAnchors)->Unit(benchmark::kMillisecond);

}  // namespace
