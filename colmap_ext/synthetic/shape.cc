#include "colmap_ext/synthetic/shape.h"

#include <algorithm>
#include <cmath>

namespace colmap_ext {
namespace {

constexpr double kMinT = 1e-9;
constexpr int kCurvedFace = 6;

// A candidate in the shape's frame.
struct LocalHit {
  double t = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  int face = 0;
};

void Keep(double t, const Eigen::Vector3d& normal, int face, LocalHit* hit) {
  if (t > kMinT && t < hit->t) *hit = {t, normal, face};
}

LocalHit IntersectRectangle(const Eigen::Vector3d& half, const Ray& ray) {
  LocalHit hit;
  if (ray.direction.z() == 0) return hit;
  const double t = -ray.origin.z() / ray.direction.z();
  const Eigen::Vector3d p = ray.origin + t * ray.direction;
  if (std::abs(p.x()) <= half.x() && std::abs(p.y()) <= half.y()) Keep(t, Eigen::Vector3d::UnitZ(), 0, &hit);
  return hit;
}

// Slabs: the ray is inside where all three intervals overlap. Only entries count; the camera is outside all
// solids.
LocalHit IntersectBox(const Eigen::Vector3d& half, const Ray& ray) {
  double enter = -std::numeric_limits<double>::infinity(), leave = std::numeric_limits<double>::infinity();
  int axis = 0;
  for (int i = 0; i < 3; ++i) {
    if (ray.direction[i] == 0) {
      if (std::abs(ray.origin[i]) > half[i]) return {};
      continue;
    }
    const double near = (-std::copysign(half[i], ray.direction[i]) - ray.origin[i]) / ray.direction[i];
    const double far = (std::copysign(half[i], ray.direction[i]) - ray.origin[i]) / ray.direction[i];
    if (near > enter) {
      enter = near;
      axis = i;
    }
    leave = std::min(leave, far);
  }
  LocalHit hit;
  if (enter > leave) return hit;
  const double side = -std::copysign(1.0, ray.direction[axis]);
  Keep(enter, side * Eigen::Vector3d::Unit(axis), 2 * axis + (side > 0 ? 1 : 0), &hit);
  return hit;
}

// Smaller root of a t^2 + 2 b t + c = 0, or infinity.
double NearRoot(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (discriminant < 0 || a == 0) return std::numeric_limits<double>::infinity();
  return (-b - std::sqrt(discriminant)) / a;
}

LocalHit IntersectSphere(double radius, const Ray& ray) {
  LocalHit hit;
  const double t = NearRoot(ray.direction.squaredNorm(), ray.origin.dot(ray.direction),
                            ray.origin.squaredNorm() - radius * radius);
  if (std::isfinite(t)) Keep(t, (ray.origin + t * ray.direction) / radius, kCurvedFace, &hit);
  return hit;
}

LocalHit IntersectCylinder(double radius, double half_height, const Ray& ray) {
  LocalHit hit;
  const Eigen::Vector2d o = ray.origin.head<2>(), d = ray.direction.head<2>();
  const double t = NearRoot(d.squaredNorm(), o.dot(d), o.squaredNorm() - radius * radius);
  if (std::isfinite(t)) {
    const Eigen::Vector3d p = ray.origin + t * ray.direction;
    if (std::abs(p.z()) <= half_height) Keep(t, {p.x() / radius, p.y() / radius, 0}, kCurvedFace, &hit);
  }
  if (ray.direction.z() != 0) {
    const double side = -std::copysign(1.0, ray.direction.z());
    const double t_cap = (side * half_height - ray.origin.z()) / ray.direction.z();
    const Eigen::Vector3d p = ray.origin + t_cap * ray.direction;
    if (p.head<2>().norm() <= radius) Keep(t_cap, {0, 0, side}, side > 0 ? 5 : 4, &hit);
  }
  return hit;
}

LocalHit IntersectLocal(const Shape& shape, const Ray& ray) {
  switch (shape.kind) {
    case ShapeKind::kRectangle:
      return IntersectRectangle(shape.half_size, ray);
    case ShapeKind::kBox:
      return IntersectBox(shape.half_size, ray);
    case ShapeKind::kSphere:
      return IntersectSphere(shape.half_size.x(), ray);
    case ShapeKind::kCylinder:
      return IntersectCylinder(shape.half_size.x(), shape.half_size.z(), ray);
  }
  return {};
}

bool MissesBoundingSphere(const Shape& shape, double radius, const Ray& ray) {
  const Eigen::Vector3d to_center = shape.center - ray.origin;
  const double along = to_center.dot(ray.direction);
  const double length2 = ray.direction.squaredNorm();
  return (to_center.squaredNorm() - radius * radius) * length2 > along * along;
}

}  // namespace

double Shape::BoundingRadius() const {
  switch (kind) {
    case ShapeKind::kRectangle:
      return half_size.head<2>().norm();
    case ShapeKind::kBox:
      return half_size.norm();
    case ShapeKind::kSphere:
      return half_size.x();
    case ShapeKind::kCylinder:
      return std::hypot(half_size.x(), half_size.z());
  }
  return 0;
}

bool Shape::IsTexturedAt(const Eigen::Vector3d& local) const {
  if (std::holds_alternative<Paint>(material)) return false;
  return !partial_paint || local[partial_paint->axis] <= partial_paint->above;
}

Radiance Shape::ColorAt(const Eigen::Vector3d& local) const {
  if (const Paint* paint = std::get_if<Paint>(&material)) return paint->At(local);
  if (!IsTexturedAt(local)) return partial_paint->paint.At(local);
  return std::get<SolidTexture>(material).At(local);
}

Hit Intersect(const std::vector<Shape>& shapes, const Ray& ray) {
  Hit best;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Shape& shape = shapes[i];
    if (MissesBoundingSphere(shape, shape.BoundingRadius() * (1 + 1e-9), ray)) continue;
    const Eigen::Matrix3d local_from_world = shape.world_from_local.transpose();
    const Ray local{local_from_world * (ray.origin - shape.center), local_from_world * ray.direction};
    const LocalHit hit = IntersectLocal(shape, local);
    if (hit.t >= best.t) continue;
    best.t = hit.t;
    best.local = local.origin + hit.t * local.direction;
    best.normal = shape.world_from_local * hit.normal;
    best.shape = static_cast<int>(i);
    best.face = hit.face;
  }
  if (best.valid() && best.normal.dot(ray.direction) > 0) best.normal = -best.normal;
  return best;
}

Eigen::Matrix3d FrameFromNormal(const Eigen::Vector3d& normal, const Eigen::Vector3d& x_axis) {
  Eigen::Matrix3d frame;
  frame.col(2) = normal.normalized();
  frame.col(0) = (x_axis - x_axis.dot(frame.col(2)) * frame.col(2)).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

}  // namespace colmap_ext
