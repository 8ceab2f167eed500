// The solids and plane patches of a synthetic scene, and their exact intersection with rays, in double
// precision.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "colmap_ext/synthetic/solid_texture.h"

namespace colmap_ext {

// Points origin + t * direction. The direction need not be unit: with camera z = 1, t is camera depth.
struct Ray {
  Eigen::Vector3d origin, direction;
};

enum class ShapeKind {
  kRectangle,  // z = 0, |x| <= half_size.x, |y| <= half_size.y
  kBox,        // |x|, |y|, |z| <= half_size
  kSphere,     // radius half_size.x
  kCylinder,   // axis z, radius half_size.x, |z| <= half_size.z, with caps
};

struct Shape {
  std::string name;  // for tests and messages
  ShapeKind kind = ShapeKind::kRectangle;
  Eigen::Vector3d half_size{1, 1, 1};  // world units
  Eigen::Matrix3d world_from_local = Eigen::Matrix3d::Identity();
  Eigen::Vector3d center{0, 0, 0};  // of the local frame, in the world
  std::variant<Paint, SolidTexture> material;
  // Texture ends at this height along the local axis `paint_axis`: above it the surface bears `upper_paint`.
  struct PartialPaint {
    int axis = 0;
    double above = 0;  // local coordinate, world units
    Paint paint;
  };
  std::optional<PartialPaint> partial_paint;

  double BoundingRadius() const;
  bool IsTexturedAt(const Eigen::Vector3d& local) const;
  Radiance ColorAt(const Eigen::Vector3d& local) const;
};

struct Hit {
  double t = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal{0, 0, 0};  // world frame, unit, facing the ray's origin
  Eigen::Vector3d local{0, 0, 0};   // the point in the shape's frame
  int shape = -1;                   // index into the scene's shapes; -1 = nothing was hit
  int face = 0;                     // which plane (or 6 = curved) of the shape

  bool valid() const { return shape >= 0; }
};

// The nearest hit with t > 1e-9.
Hit Intersect(const std::vector<Shape>& shapes, const Ray& ray);

// The unit normal's rotation for a rectangle whose z axis is `normal` and whose x axis is closest to
// `x_axis`.
Eigen::Matrix3d FrameFromNormal(const Eigen::Vector3d& normal, const Eigen::Vector3d& x_axis);

}  // namespace colmap_ext
