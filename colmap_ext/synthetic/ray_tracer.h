// Renders shapes with a pinhole camera: an antialiased image, and exact depth and normals at the pixel
// centres.
#pragma once

#include <cstdint>
#include <vector>

#include "colmap_ext/synthetic/shape.h"
#include "phi/base/images.h"
#include "phi/geometry/camera.h"
#include "phi/geometry/plane_hypothesis.h"

namespace colmap_ext {

// Identifies the shape and face seen at a pixel; 0 = nothing. Two pixels on one plane of one shape agree.
using SurfaceId = std::uint16_t;

struct TracedView {
  phi::Array2D<Radiance> radiance;   // mean over the pixel's area, grey levels before exposure and noise
  phi::PlaneMap truth;               // at the pixel centres; depth 0 where nothing is
  phi::Array2D<SurfaceId> surfaces;  // at the pixel centres
  phi::Mask textured;  // 255 where the pixel centre's surface bears a texture, 0 where it is painted
};

// The world ray through (u, v) of K's coordinates; t is camera z.
Ray PixelRay(const phi::Camera& camera, double u, double v);

// supersampling^2 rays a pixel on a regular grid. Multi-threaded; the result does not depend on the threads.
TracedView TraceView(const std::vector<Shape>& shapes, const phi::Camera& camera, int supersampling);

// World point -> (u, v) in K's coordinates and camera z.
Eigen::Vector3d Project(const phi::Camera& camera, const Eigen::Vector3d& world);

}  // namespace colmap_ext
