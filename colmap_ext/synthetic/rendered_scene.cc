#include "colmap_ext/synthetic/rendered_scene.h"

#include <cmath>

#include <tbb/parallel_for.h>

namespace colmap_ext {

std::vector<phi::ViewImage> RenderedScene::SourceImages(int reference) const {
  std::vector<phi::ViewImage> sources;
  for (int i = 0; i < static_cast<int>(views.size()); ++i) {
    if (i != reference) sources.push_back(Image(i));
  }
  return sources;
}

std::vector<phi::SourceMap> RenderedScene::SourceTruth(int reference) const {
  std::vector<phi::SourceMap> sources;
  for (int i = 0; i < static_cast<int>(views.size()); ++i) {
    if (i == reference) continue;
    const auto map = std::make_shared<const phi::MeasurementMap>(phi::MeasurementMap{*truth[i], {}});
    sources.push_back({&views[i], [map] { return map; }});
  }
  return sources;
}

phi::Array2D<int> CountOtherViews(const RenderedScene& scene, int reference) {
  const phi::PlaneMap& map = *scene.truth[reference];
  const phi::Camera& camera = scene.views[reference].camera;
  phi::Array2D<int> counts(map.width(), map.height());
  tbb::parallel_for(0, map.height(), [&](int y) {
    for (int x = 0; x < map.width(); ++x) {
      if (!(map(x, y).depth > 0)) continue;
      const Ray ray = PixelRay(camera, x + 0.5, y + 0.5);
      const Eigen::Vector3d world = ray.origin + static_cast<double>(map(x, y).depth) * ray.direction;
      for (int j = 0; j < static_cast<int>(scene.views.size()); ++j) {
        if (j == reference) continue;
        const Eigen::Vector3d p = Project(scene.views[j].camera, world);
        const phi::PlaneMap& other = *scene.truth[j];
        if (!(p.z() > 0) || p.x() < 0 || p.y() < 0 || p.x() >= other.width() || p.y() >= other.height())
          continue;
        const double depth = other(static_cast<int>(p.x()), static_cast<int>(p.y())).depth;
        if (std::abs(depth - p.z()) <= 0.01 * p.z()) ++counts(x, y);
      }
    }
  });
  return counts;
}

phi::Pose Transformed(const phi::Pose& pose, const Similarity& new_from_old) {
  phi::Pose moved;
  moved.rotation = pose.rotation * new_from_old.rotation.transpose();
  moved.translation = new_from_old.scale * pose.translation - moved.rotation * new_from_old.translation;
  return moved;
}

phi::PlaneMap Scaled(const phi::PlaneMap& map, double scale) {
  phi::PlaneMap scaled = map;
  for (phi::PlaneHypothesis& h : scaled) h.depth = static_cast<float>(scale * h.depth);
  return scaled;
}

void Transform(const Similarity& new_from_old, RenderedScene* scene) {
  for (phi::SceneView& view : scene->views) view.camera.pose = Transformed(view.camera.pose, new_from_old);
  for (auto& map : scene->truth)
    map = std::make_shared<const phi::PlaneMap>(Scaled(*map, new_from_old.scale));
}

}  // namespace colmap_ext
