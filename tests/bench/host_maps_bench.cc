// What the host does to every finished map beside the card, one thread, on an image of 6 megapixels.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <cstdint>
#include <filesystem>
#include <random>
#include <utility>
#include <vector>

#include "colmap_ext/compact_codes.h"
#include "colmap_ext/compact_map.h"
#include "colmap_ext/map_file.h"
#include "phi/measurement.h"

namespace {

constexpr int kWidth = 3072, kHeight = 2048;

// Depths of a slope with noise, normals with noise, three pixels in ten without depth.
phi::MeasurementMap NoisyMap() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> noise(-0.1f, 0.1f);
  std::bernoulli_distribution has_depth(0.7);
  phi::PlaneMap map(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (!has_depth(random)) continue;
      const phi::Vec3f normal{0.6f + noise(random), noise(random), -0.8f};
      map(x, y) = {phi::Normalized(normal), 3 + 0.001f * static_cast<float>(x) + 0.01f * noise(random)};
    }
  }
  return phi::AllMeasured(std::move(map));
}

void RoundMap(benchmark::State& state) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const phi::MeasurementMap map = NoisyMap();
  for (auto _ : state) {
    state.PauseTiming();
    phi::MeasurementMap exact = map;
    state.ResumeTiming();
    benchmark::DoNotOptimize(colmap_ext::RoundToCompact(std::move(exact)).planes.data());
  }
}
BENCHMARK(RoundMap)->Unit(benchmark::kMillisecond);

void EncodeMap(benchmark::State& state) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const phi::MeasurementMap map = colmap_ext::RoundToCompact(NoisyMap());
  for (auto _ : state) benchmark::DoNotOptimize(colmap_ext::EncodeCompactMap(map).data());
}
BENCHMARK(EncodeMap)->Unit(benchmark::kMillisecond);

void DecodeMap(benchmark::State& state) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<std::uint8_t> bytes = colmap_ext::EncodeCompactMap(colmap_ext::RoundToCompact(NoisyMap()));
  for (auto _ : state) benchmark::DoNotOptimize(colmap_ext::DecodeCompactMap(bytes, "map").planes.data());
}
BENCHMARK(DecodeMap)->Unit(benchmark::kMillisecond);

void WriteMaps(benchmark::State& state) {
  const phi::MeasurementMap map = NoisyMap();
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  for (auto _ : state) {
    colmap_ext::WritePlaneMap(folder / "host_maps_bench.depth.bin", folder / "host_maps_bench.normal.bin", map.planes);
  }
  for (const char* name : {"host_maps_bench.depth.bin", "host_maps_bench.normal.bin"}) std::filesystem::remove(folder / name);
}
BENCHMARK(WriteMaps)->Unit(benchmark::kMillisecond);

}  // namespace
