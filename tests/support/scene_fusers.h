// Fusion's maps and fusers of scenes with exact truth.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <algorithm>
#include <random>
#include <string_view>
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

// Noise of up to 4 tolerances in depth and 20 degrees in normals, holes, inferred and emitted pixels, colours: every answer
// comes up.
inline std::vector<phi::FusionMap> MakeNoisyMaps(const RenderedScene& scene) {
  std::vector<phi::FusionMap> maps = MakeMaps(scene);
  std::mt19937 random(7);
  const auto uniform = [&](float least, float most) {
    return least + (most - least) * static_cast<float>(random()) / 4294967296.0f;
  };
  for (phi::FusionMap& map : maps) {
    for (std::size_t i = 0; i < map.size(); ++i) {
      phi::FusionPixel& pixel = map.data()[i];
      if (random() % 10 == 0) pixel.depth = 0;
      pixel.depth *= 1 + uniform(-0.02f, 0.02f) * (random() % 3 == 0 ? 2 : 0.2f);
      const phi::Vec3f n = phi::UnpackNormal(pixel.normal);
      const float tilt = random() % 2 == 0 ? 0.2f : 0.02f;
      pixel.normal = phi::PackNormal(
          phi::Normalized({n.x + uniform(-tilt, tilt), n.y + uniform(-tilt, tilt), n.z + uniform(-tilt, tilt)}));
      for (std::uint8_t& c : pixel.rgb) c = static_cast<std::uint8_t>(random());
      pixel.flags = (random() % 4 == 0 ? phi::FusionPixel::kInferred : 0) | (random() % 3 == 0 ? phi::FusionPixel::kEmitted : 0);
    }
  }
  return maps;
}

// Image `reference` of the scene, all others its neighbours; those with smaller indices were fused before.
inline phi::ImageFuser MakeFuser(const RenderedScene& scene, std::size_t reference,
                                 const phi::FusionOptions& options, std::vector<phi::FusionMap>* maps,
                                 const phi::BoundingBox* box = nullptr, phi::FusionDevice* device = nullptr) {
  const auto image = [&](std::size_t i) {
    return phi::ImageFuser::Image{static_cast<std::uint32_t>(i), scene.views[i].camera, &(*maps)[i],
                                  i < reference};
  };
  std::vector<phi::ImageFuser::Image> neighbors;
  for (std::size_t i = 0; i < maps->size(); ++i) {
    if (i != reference) neighbors.push_back(image(i));
  }
  return phi::ImageFuser(image(reference), neighbors, options, box, device);
}

// What fusion makes of all images, one after the other, and what it leaves in the maps.
struct FusedScene {
  std::vector<phi::FusedBlock> blocks;
  std::vector<phi::FusionMap> maps;
  std::vector<phi::Array2D<float>> confidences;  // of each map's pixels
};

inline FusedScene FuseAllImages(const RenderedScene& scene, const phi::FusionOptions& options, const phi::BoundingBox* box,
                                phi::FusionDevice* device) {
  constexpr int kRows = 7;
  FusedScene fused{{}, MakeNoisyMaps(scene), {}};
  for (std::size_t i = 0; i < fused.maps.size(); ++i) {
    phi::ImageFuser fuser = MakeFuser(scene, i, options, &fused.maps, box, device);
    const int height = fused.maps[i].height();
    for (int y = 0; y < height; y += kRows) fused.blocks.push_back(fuser.FuseRows(y, std::min(y + kRows, height)));
    for (int y = 0; y < height; y += kRows) fused.blocks.push_back(fuser.FillHoles(y, std::min(y + kRows, height)));
    fused.confidences.emplace_back(fused.maps[i].width(), height, 0.0f);
    fuser.RateRows(0, height, &fused.confidences.back());
  }
  return fused;
}

inline void ExpectSameBytes(const FusedScene& a, const FusedScene& b) {
  const auto bytes = [](const auto& elements) {
    return std::string_view(reinterpret_cast<const char*>(elements.data()), elements.size() * sizeof(*elements.data()));
  };
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t k = 0; k < a.blocks.size(); ++k) {
    ASSERT_EQ(bytes(a.blocks[k].points), bytes(b.blocks[k].points)) << "block " << k;
    ASSERT_EQ(a.blocks[k].view_counts, b.blocks[k].view_counts) << "block " << k;
    ASSERT_EQ(a.blocks[k].views, b.blocks[k].views) << "block " << k;
    for (int outcome = 0; outcome < phi::kNumPixelOutcomes; ++outcome) {
      const auto of = static_cast<phi::PixelOutcome>(outcome);
      ASSERT_EQ(a.blocks[k].outcomes[of], b.blocks[k].outcomes[of]) << "block " << k << ", outcome " << outcome;
    }
  }
  for (std::size_t i = 0; i < a.maps.size(); ++i) {
    ASSERT_EQ(bytes(a.maps[i]), bytes(b.maps[i])) << "map " << i;
    ASSERT_EQ(bytes(a.confidences[i]), bytes(b.confidences[i])) << "map " << i;
  }
}

}  // namespace test_support
