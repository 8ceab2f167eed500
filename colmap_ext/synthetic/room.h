// A synthetic furnished room: images as a camera would take them, with exact depth, normals and a sparse
// model.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_ext/sparse_model.h"
#include "colmap_ext/synthetic/rendered_scene.h"

namespace colmap_ext {

struct SyntheticRoomOptions {
  int width = 480, height = 360;  // --width, --height: pixels
  int num_views = 8;              // --num_views
  double texture_share = 0.55;    // --texture_share: of all pixels; the others see paint, [0, 1]
  double noise_sigma = 1;         // --noise_sigma: grey levels
  double exposure_jitter = 0.05;  // --exposure_jitter: each view's gain is within 1 +- this
  int jpeg_quality = 95;          // --jpeg_quality: percent; 0 = PNG
  std::uint32_t seed = 0;         // --default_random_seed: textures, noise, exposure, sparse points
  int supersampling = 4;          // rays a pixel, along each axis

  std::string Check() const;  // empty, or one sentence naming option, value and rule
};

struct SyntheticRoom {
  RenderedScene scene;                                 // images are decoded from image_files
  std::vector<std::vector<std::uint8_t>> image_files;  // parallel to scene.views: JPEG or PNG, RGB
  SparseModel model;
};

// Deterministic for given options, whatever the number of threads. Throws phi::UsageError when they are not
// valid.
SyntheticRoom MakeSyntheticRoom(const SyntheticRoomOptions& options = {});

// Moves and scales the world: poses, points, depths. Images stay as they are.
void Transform(const Similarity& new_from_old, SyntheticRoom* room);

// folder/dense: an undistorted COLMAP workspace without maps. folder/truth:
// {depth_maps,normal_maps}/<image>.bin, the exact maps, and textured_masks/<image>.png (255 = textured, 0 =
// painted). Throws phi::InputError when one of the two folders is there already.
void WriteSyntheticRoom(const SyntheticRoom& room, const std::filesystem::path& folder);

}  // namespace colmap_ext
