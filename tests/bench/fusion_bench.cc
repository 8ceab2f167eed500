// Fusion of exact maps of a sphere before a wall: the first image, which no point covers yet, and the last, most of
// whose pixels are covered. One thread; items are pixels of the reference.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

#include "phi/fusion/image_fusion.h"
#include "tests/support/exact_scenes.h"

namespace {

using test_support::RenderedScene;

constexpr int kWidth = 640, kHeight = 480;

struct FusionScene {
  RenderedScene scene;
  std::vector<phi::FusionMap> maps;
};

FusionScene MakeFusionScene(int num_views) {
  FusionScene fusion;
  fusion.scene = test_support::SphereScene(
      {.width = kWidth, .height = kHeight, .focal = 600, .num_views = num_views, .supersampling = 1});
  for (const auto& truth : fusion.scene.truth) {
    phi::FusionMap map(truth->width(), truth->height());
    for (std::size_t i = 0; i < map.size(); ++i) {
      map.data()[i].depth = truth->data()[i].depth;
      map.data()[i].normal = phi::PackNormal(truth->data()[i].normal);
    }
    fusion.maps.push_back(std::move(map));
  }
  return fusion;
}

phi::ImageFuser MakeFuser(FusionScene* fusion, std::size_t reference, const phi::FusionOptions& options) {
  const auto image = [&](std::size_t i) {
    return phi::ImageFuser::Image{static_cast<std::uint32_t>(i), fusion->scene.views[i].camera,
                                  &fusion->maps[i], i < reference};
  };
  std::vector<phi::ImageFuser::Image> neighbors;
  for (std::size_t i = 0; i < fusion->maps.size(); ++i) {
    if (i != reference) neighbors.push_back(image(i));
  }
  return phi::ImageFuser(image(reference), neighbors, options, nullptr);
}

void FuseImage(benchmark::State& state, FusionScene* fusion, std::size_t reference) {
  phi::ImageFuser fuser = MakeFuser(fusion, reference, {});
  std::int64_t num_points = 0;
  for (auto _ : state) {
    const phi::FusedBlock block = fuser.FuseRows(0, kHeight);
    num_points = static_cast<std::int64_t>(block.points.size());
    benchmark::DoNotOptimize(block.points.data());
  }
  state.SetItemsProcessed(state.iterations() * kWidth * kHeight);
  state.counters["points"] = static_cast<double>(num_points);
}

void FirstImage(benchmark::State& state) {
  FusionScene fusion = MakeFusionScene(static_cast<int>(state.range(0)));
  FuseImage(state, &fusion, 0);
}

void LastImage(benchmark::State& state) {
  FusionScene fusion = MakeFusionScene(static_cast<int>(state.range(0)));
  for (std::size_t i = 0; i + 1 < fusion.maps.size(); ++i) MakeFuser(&fusion, i, {}).FuseRows(0, kHeight);
  FuseImage(state, &fusion, fusion.maps.size() - 1);
}

BENCHMARK(FirstImage)->Arg(5)->Arg(20)->Unit(benchmark::kMillisecond);
BENCHMARK(LastImage)->Arg(5)->Arg(20)->Unit(benchmark::kMillisecond);

}  // namespace
