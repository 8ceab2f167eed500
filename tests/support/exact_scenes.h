// Small exact scenes for unit tests: one textured plane, or a sphere before a wall, seen by a few known
// cameras.
//
// View 0 is at the world's origin and looks along +z, so world and camera frame agree there. The other views
// lie on a circle of radius `baseline` in its image plane and look at the point (0, 0, depth).
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "colmap_ext/synthetic/rendered_scene.h"
#include "phi/backend.h"

namespace test_support {

using colmap_ext::RenderedScene;

struct ExactSceneOptions {
  int width = 160, height = 120;
  double focal = 150;  // pixels, fx; fy is 2 % longer, the principal point is off the middle by (3, -2)
  int num_views = 5;
  double depth = 4;            // of the point that all views look at, world units
  double baseline = 0.5;       // world units
  double noise_sigma = 0;      // grey levels
  double exposure_jitter = 0;  // relative, uniform in +-
  int supersampling = 3;
  std::uint32_t seed = 1;
};

// The infinite-looking plane through (0, 0, depth) with the given normal in view 0's frame (need not be unit;
// its z < 0).
RenderedScene PlaneScene(const ExactSceneOptions& options = {},
                         const Eigen::Vector3d& normal = Eigen::Vector3d(0.4, -0.2, -1));

// A sphere with its centre at (0, 0, depth), before the textured wall z = 1.5 * depth.
RenderedScene SphereScene(const ExactSceneOptions& options = {}, double radius = 1);

// Upright slats, `width` world units wide and facing view 0 at `depth`, before the textured wall z = 1.5 * depth; their
// axes lie four widths apart.
RenderedScene SlatScene(const ExactSceneOptions& options, double width);

// View 0 as the reference of an estimation between the depths 2 and 10, all others as its sources; without noise.
phi::EstimationInput InputOf(const RenderedScene& scene);

}  // namespace test_support
