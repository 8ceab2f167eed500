// Sparse points with tracks on the textured surfaces of a synthetic scene, as a mapper would leave them.
#pragma once

#include <cstdint>
#include <vector>

#include "colmap_ext/image_file.h"
#include "colmap_ext/sparse_model.h"
#include "colmap_ext/synthetic/rendered_scene.h"

namespace colmap_ext {

struct SparsePointOptions {
  int num_new_per_view = 250;      // pixels of each view that are tried as new points
  double observation_sigma = 0.3;  // pixels, each of x and y
  int min_track_length = 3;        // views
  std::uint32_t seed = 0;
};

// The model of the scene's cameras, with points. A point is observed in every view where an exact ray test
// shows it; its position is triangulated from its noisy observations. Needs all views to have one size and
// intrinsics.
SparseModel MakeSparseModel(const std::vector<Shape>& shapes, const RenderedScene& scene,
                            const std::vector<ColorImage>& color_images, const SparsePointOptions& options);

}  // namespace colmap_ext
