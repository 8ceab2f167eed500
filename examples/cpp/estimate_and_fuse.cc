// Estimates and fuses a synthetic room, all in memory.
//
//   cmake -S examples/cpp -B build/example && cmake --build build/example && build/example/estimate_and_fuse
#include <phimvs/colmap_ext.h>

#include <cmath>
#include <iostream>
#include <utility>
#include <vector>

int main() {
  const colmap_ext::SyntheticRoom room = colmap_ext::MakeSyntheticRoom({.width = 160, .height = 120, .num_views = 4});

  // A scene of your own: photos of their cameras' size, poses cam_from_world, and a sparse model with the cameras.
  std::vector<colmap_ext::MemoryImage> images;
  for (std::size_t i = 0; i < room.scene.views.size(); ++i) {
    images.push_back({room.scene.views[i].camera.pose, room.scene.images[i], nullptr, nullptr});
  }
  const colmap_ext::Workspace scene(room.model, std::move(images), /*max_image_size=*/-1);

  const auto backends = colmap_ext::MakeBackends({});  // the GPUs, or else the CPU
  const auto maps = colmap_ext::EstimateScene(scene, /*sources=*/{}, colmap_ext::PipelineOptions(), backends);
  const colmap_ext::SceneCloud cloud = colmap_ext::FuseSceneMaps(scene, maps, colmap_ext::SceneFusionOptions());

  int num_compared = 0, num_right = 0;  // within 2 % of the exact depth
  for (std::size_t i = 0; i < maps.size(); ++i) {
    for (std::size_t pixel = 0; pixel < maps[i].map->size(); ++pixel) {
      const float depth = maps[i].map->data()[pixel].depth, truth = room.scene.truth[i]->data()[pixel].depth;
      if (!(depth > 0)) continue;
      ++num_compared;
      num_right += std::abs(depth - truth) <= 0.02f * truth ? 1 : 0;
    }
  }
  std::cout << "phimvs " PHIMVS_VERSION_STRING ": " << cloud.report.num_points << " points, " << 100.0 * num_right / num_compared
            << " % of the depths right\n";
  return cloud.report.num_points > 1000 && num_right > 0.7 * num_compared ? 0 : 1;
}
