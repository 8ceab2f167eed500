#include "colmap_ext/synthetic/sparse_points.h"

#include <cmath>
#include <optional>

#include "colmap_ext/synthetic/sensor.h"
#include "phi/geometry/triangulation_step.h"

namespace colmap_ext {
namespace {

constexpr double kMinGrazing =
    0.15;  // cosine between normal and ray: no detector finds the same spot below this
// Streams of random numbers that do not meet those of the images' noise (which use the image ids).
constexpr std::uint32_t kPlacementStream = 0x80000000u, kObservationStream = 0x40000000u;

struct Track {
  std::vector<int> views;
  std::vector<Eigen::Vector2d> pixels;  // noisy, K's coordinates
};

// Whether view `camera` sees the point itself and not something before it.
bool Sees(const std::vector<Shape>& shapes, const phi::Camera& camera, const Eigen::Vector3d& world) {
  const Eigen::Vector3d p = Project(camera, world);
  if (!(p.z() > 0) || p.x() < 0 || p.y() < 0 || p.x() > camera.pinhole.width ||
      p.y() > camera.pinhole.height) {
    return false;
  }
  const Ray ray = PixelRay(camera, p.x(), p.y());
  const Hit hit = Intersect(shapes, ray);
  return hit.valid() && std::abs(hit.t - p.z()) <= 1e-6 * p.z() &&
         -hit.normal.dot(ray.direction) > kMinGrazing * ray.direction.norm();
}

Track ObservePoint(const std::vector<Shape>& shapes, const RenderedScene& scene, const Eigen::Vector3d& world,
                   std::uint64_t candidate, const SparsePointOptions& options) {
  Track track;
  for (int j = 0; j < static_cast<int>(scene.views.size()); ++j) {
    const phi::SceneView& view = scene.views[j];
    if (!Sees(shapes, view.camera, world)) continue;
    const auto noise = GaussianPair({options.seed, kObservationStream + view.image_id}, candidate);
    const Eigen::Vector2d pixel = Project(view.camera, world).head<2>() +
                                  options.observation_sigma * Eigen::Vector2d(noise[0], noise[1]);
    const bool inside = (pixel.array() >= 0).all() && pixel.x() <= view.camera.pinhole.width &&
                        pixel.y() <= view.camera.pinhole.height;
    if (!inside) continue;
    track.views.push_back(j);
    track.pixels.push_back(pixel);
  }
  return track;
}

// Gauss-Newton on the reprojection errors, from a start that is right up to the noise.
Eigen::Vector3d Triangulate(const RenderedScene& scene, const Track& track, Eigen::Vector3d world) {
  for (int iteration = 0; iteration < 5; ++iteration) {
    phi::TriangulationStep step;
    for (std::size_t i = 0; i < track.views.size(); ++i) {
      const phi::Camera& camera = scene.views[track.views[i]].camera;
      step.Add(camera, camera.pose * world, track.pixels[i] - Project(camera, world).head<2>());
    }
    world += step.Solve();
  }
  return world;
}

double MeanReprojectionError(const RenderedScene& scene, const Track& track, const Eigen::Vector3d& world) {
  double sum = 0;
  for (std::size_t i = 0; i < track.views.size(); ++i) {
    sum += (track.pixels[i] - Project(scene.views[track.views[i]].camera, world).head<2>()).norm();
  }
  return sum / static_cast<double>(track.views.size());
}

// An exact world point, and the pixel of the view that was drawn.
struct DrawnPoint {
  Eigen::Vector3d world;
  int x, y;
};

// A random textured pixel of the view.
std::optional<DrawnPoint> DrawPoint(const std::vector<Shape>& shapes, const phi::Camera& camera, std::uint64_t candidate,
                                    std::uint32_t seed) {
  const phi::Random4 words = phi::Philox({seed, kPlacementStream}, candidate, 0, 0);
  const double u = phi::UniformFloat(words.v[0]) * camera.pinhole.width;
  const double v = phi::UniformFloat(words.v[1]) * camera.pinhole.height;
  const Ray ray = PixelRay(camera, u, v);
  const Hit hit = Intersect(shapes, ray);
  if (!hit.valid() || !shapes[hit.shape].IsTexturedAt(hit.local)) return std::nullopt;
  return DrawnPoint{ray.origin + hit.t * ray.direction, static_cast<int>(u), static_cast<int>(v)};
}

SparseModel MakeCameras(const RenderedScene& scene) {
  SparseModel model;
  const phi::Pinhole& k = scene.views.front().camera.pinhole;
  SparseCamera& camera = model.cameras[1];
  camera.camera_id = 1;
  camera.model_id = 1;  // PINHOLE
  camera.width = k.width;
  camera.height = k.height;
  camera.params = {k.fx, k.fy, k.cx, k.cy};
  for (const phi::SceneView& view : scene.views) {
    SparseImage image;
    image.image_id = view.image_id;
    image.rotation = Eigen::Quaterniond(view.camera.pose.rotation).normalized();
    image.translation = view.camera.pose.translation;
    image.camera_id = 1;
    image.name = view.name;
    model.images.push_back(image);
  }
  return model;
}

void AddPoint(const Track& track, SparsePoint point, SparseModel* model) {
  point.point3D_id = model->points.size() + 1;
  for (std::size_t i = 0; i < track.views.size(); ++i) {
    SparseImage& image = model->images[track.views[i]];
    point.track.push_back({image.image_id, static_cast<std::uint32_t>(image.observations.size())});
    image.observations.push_back({track.pixels[i].x(), track.pixels[i].y(), point.point3D_id});
  }
  model->points.push_back(std::move(point));
}

}  // namespace

SparseModel MakeSparseModel(const std::vector<Shape>& shapes, const RenderedScene& scene,
                            const std::vector<ColorImage>& color_images, const SparsePointOptions& options) {
  SparseModel model = MakeCameras(scene);
  std::uint64_t candidate = 0;
  for (int view = 0; view < static_cast<int>(scene.views.size()); ++view) {
    for (int i = 0; i < options.num_new_per_view; ++i) {
      const auto drawn = DrawPoint(shapes, scene.views[view].camera, ++candidate, options.seed);
      if (!drawn) continue;
      const Track track = ObservePoint(shapes, scene, drawn->world, candidate, options);
      if (static_cast<int>(track.views.size()) < options.min_track_length) continue;
      SparsePoint point;
      point.xyz = Triangulate(scene, track, drawn->world);
      point.rgb = color_images[view](drawn->x, drawn->y);
      point.error = MeanReprojectionError(scene, track, point.xyz);
      AddPoint(track, std::move(point), &model);
    }
  }
  return model;
}

}  // namespace colmap_ext
