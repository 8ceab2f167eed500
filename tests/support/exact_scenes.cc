#include "tests/support/exact_scenes.h"

#include <cmath>
#include <string>
#include <vector>

#include "colmap_ext/synthetic/sensor.h"

namespace test_support {
namespace {

using colmap_ext::Shape;
using colmap_ext::ShapeKind;
using colmap_ext::SolidTexture;

// Looks from `center` at `target`, upright with respect to view 0.
phi::Pose LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - center).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(forward).normalized();
  phi::Pose pose;
  pose.rotation.row(0) = right;
  pose.rotation.row(1) = forward.cross(right);
  pose.rotation.row(2) = forward;
  pose.translation = -pose.rotation * center;
  return pose;
}

std::vector<phi::SceneView> MakeViews(const ExactSceneOptions& options) {
  std::vector<phi::SceneView> views(options.num_views);
  for (int i = 0; i < options.num_views; ++i) {
    views[i].name = "view" + std::to_string(i) + ".png";
    views[i].image_id = i + 1;
    views[i].camera.pinhole = {options.width,        options.height,          options.focal,
                               1.02 * options.focal, 0.5 * options.width + 3, 0.5 * options.height - 2};
    if (i == 0) continue;
    const double angle = 2 * M_PI * (i - 1) / (options.num_views - 1);
    const Eigen::Vector3d center = options.baseline * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    views[i].camera.pose = LookAt(center, {0, 0, options.depth});
  }
  return views;
}

SolidTexture MakeTexture(const ExactSceneOptions& options, std::uint32_t seed) {
  const double pixel = options.depth / options.focal;  // footprint of a pixel, world units
  SolidTexture texture;
  texture.dark = {20, 30, 40};
  texture.light = {230, 220, 210};
  texture.finest_spacing = 1.6 * pixel;
  texture.coarsest_spacing = 16 * texture.finest_spacing;
  texture.seed = seed;
  return texture;
}

RenderedScene Render(const std::vector<Shape>& shapes, const ExactSceneOptions& options) {
  RenderedScene scene;
  scene.views = MakeViews(options);
  for (const phi::SceneView& view : scene.views) {
    colmap_ext::TracedView traced = colmap_ext::TraceView(shapes, view.camera, options.supersampling);
    const phi::RandomKey key{options.seed, view.image_id};
    colmap_ext::SensorOptions sensor;
    sensor.gain = 1 + options.exposure_jitter * phi::SymmetricFloat(phi::Philox(key, 0, 1, 0).v[0]);
    sensor.noise_sigma = options.noise_sigma;
    sensor.key = key;
    scene.images.push_back(
        std::make_shared<phi::GrayImage>(colmap_ext::ToGray(colmap_ext::Develop(traced.radiance, sensor))));
    scene.truth.push_back(std::make_shared<phi::PlaneMap>(std::move(traced.truth)));
    scene.textured.push_back(std::make_shared<phi::Mask>(std::move(traced.textured)));
    scene.surfaces.push_back(
        std::make_shared<phi::Array2D<colmap_ext::SurfaceId>>(std::move(traced.surfaces)));
  }
  return scene;
}

Shape LargePlane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, const SolidTexture& texture) {
  Shape plane;
  plane.name = "plane";
  plane.kind = ShapeKind::kRectangle;
  plane.half_size = {1e3, 1e3, 0};
  plane.world_from_local = colmap_ext::FrameFromNormal(normal, Eigen::Vector3d::UnitX());
  plane.center = point;
  plane.material = texture;
  return plane;
}

}  // namespace

RenderedScene PlaneScene(const ExactSceneOptions& options, const Eigen::Vector3d& normal) {
  return Render({LargePlane({0, 0, options.depth}, normal, MakeTexture(options, options.seed))}, options);
}

RenderedScene SphereScene(const ExactSceneOptions& options, double radius) {
  Shape sphere;
  sphere.name = "sphere";
  sphere.kind = ShapeKind::kSphere;
  sphere.half_size = Eigen::Vector3d::Constant(radius);
  sphere.center = {0, 0, options.depth};
  sphere.material = MakeTexture(options, options.seed);
  const Shape wall = LargePlane({0, 0, 1.5 * options.depth}, -Eigen::Vector3d::UnitZ(),
                                MakeTexture(options, options.seed + 1));
  return Render({sphere, wall}, options);
}

RenderedScene SlatScene(const ExactSceneOptions& options, double width) {
  std::vector<Shape> shapes;
  for (int i = -20; i <= 20; ++i) {
    Shape slat = LargePlane({4 * width * i, 0, options.depth}, -Eigen::Vector3d::UnitZ(),
                            MakeTexture(options, options.seed));
    slat.name = "slat";
    slat.half_size = {0.5 * width, 1e3, 0};
    shapes.push_back(slat);
  }
  shapes.push_back(LargePlane({0, 0, 1.5 * options.depth}, -Eigen::Vector3d::UnitZ(),
                              MakeTexture(options, options.seed + 1)));
  return Render(shapes, options);
}

phi::EstimationInput InputOf(const RenderedScene& scene) {
  phi::EstimationInput input;
  input.reference = scene.Image(0);
  input.sources = scene.SourceImages(0);
  input.depth_min = 2;
  input.depth_max = 10;
  return input;
}

}  // namespace test_support
