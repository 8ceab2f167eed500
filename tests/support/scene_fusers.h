// Fusion's maps and fusers of scenes with exact truth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "phi/fusion/image_fusion.h"
#include "tests/support/exact_scenes.h"

namespace test_support {

inline std::vector<phi::FusionMap> MakeMaps(const RenderedScene& scene) {
  std::vector<phi::FusionMap> maps;
  for (const auto& truth : scene.truth) {
    phi::FusionMap map(truth->width(), truth->height());
    for (std::size_t i = 0; i < map.size(); ++i) {
      map.data()[i].depth = truth->data()[i].depth;
      map.data()[i].normal = phi::PackNormal(truth->data()[i].normal);
    }
    maps.push_back(std::move(map));
  }
  return maps;
}

// Image `reference` of the scene, all others its neighbours; those with smaller indices were fused before.
inline phi::ImageFuser MakeFuser(const RenderedScene& scene, std::size_t reference,
                                 const phi::FusionOptions& options, std::vector<phi::FusionMap>* maps,
                                 const phi::BoundingBox* box = nullptr) {
  const auto image = [&](std::size_t i) {
    return phi::ImageFuser::Image{static_cast<std::uint32_t>(i), scene.views[i].camera, &(*maps)[i],
                                  i < reference};
  };
  std::vector<phi::ImageFuser::Image> neighbors;
  for (std::size_t i = 0; i < maps->size(); ++i) {
    if (i != reference) neighbors.push_back(image(i));
  }
  return phi::ImageFuser(image(reference), neighbors, options, box);
}

}  // namespace test_support
