#include "colmap_ext/synthetic/ray_tracer.h"

#include <tbb/parallel_for.h>

namespace colmap_ext {
namespace {

// Fixed, smooth light: a bright ceiling and a window to one side. It depends on the normal alone, so a
// painted plane has one brightness all over.
float Shade(const Eigen::Vector3d& normal) {
  static const Eigen::Vector3d window = Eigen::Vector3d(-0.6, -0.7, 0.4).normalized();
  const double from_above = 0.5 * (1 + normal.z());
  const double from_window = 0.5 * (1 + normal.dot(window));
  return static_cast<float>(0.45 + 0.2 * from_above + 0.35 * from_window);
}

Radiance ColorOf(const std::vector<Shape>& shapes, const Hit& hit) {
  if (!hit.valid()) return Radiance::Zero();
  return Shade(hit.normal) * shapes[hit.shape].ColorAt(hit.local);
}

void TracePixel(const std::vector<Shape>& shapes, const phi::Camera& camera, int supersampling, int x, int y,
                TracedView* view) {
  const Hit hit = Intersect(shapes, PixelRay(camera, x + 0.5, y + 0.5));
  if (hit.valid()) {
    const Eigen::Vector3f normal = (camera.pose.rotation * hit.normal).cast<float>();
    view->truth(x, y) = {{normal.x(), normal.y(), normal.z()}, static_cast<float>(hit.t)};
    view->surfaces(x, y) = static_cast<SurfaceId>(1 + hit.shape * 8 + hit.face);
    view->textured(x, y) = shapes[hit.shape].IsTexturedAt(hit.local) ? 255 : 0;
  }
  Radiance sum = Radiance::Zero();
  for (int j = 0; j < supersampling; ++j) {
    for (int i = 0; i < supersampling; ++i) {
      const double u = x + (i + 0.5) / supersampling, v = y + (j + 0.5) / supersampling;
      sum += ColorOf(shapes, Intersect(shapes, PixelRay(camera, u, v)));
    }
  }
  view->radiance(x, y) = sum / static_cast<float>(supersampling * supersampling);
}

}  // namespace

Ray PixelRay(const phi::Camera& camera, double u, double v) {
  const phi::Pinhole& k = camera.pinhole;
  const Eigen::Vector3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1);
  return {camera.pose.Center(), camera.pose.rotation.transpose() * ray};
}

Eigen::Vector3d Project(const phi::Camera& camera, const Eigen::Vector3d& world) {
  const Eigen::Vector3d p = camera.pose * world;
  const Eigen::Vector2d pixel = camera.pinhole.Project(p);
  return {pixel.x(), pixel.y(), p.z()};
}

TracedView TraceView(const std::vector<Shape>& shapes, const phi::Camera& camera, int supersampling) {
  const int width = camera.pinhole.width, height = camera.pinhole.height;
  TracedView view{{width, height, Radiance::Zero()}, {width, height}, {width, height}, {width, height}};
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) TracePixel(shapes, camera, supersampling, x, y, &view);
  });
  return view;
}

}  // namespace colmap_ext
