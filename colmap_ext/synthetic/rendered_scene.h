// Views of a synthetic scene with their images and exact maps, in memory and independent of file formats.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "colmap_ext/synthetic/ray_tracer.h"
#include "phi/scene_view.h"

namespace colmap_ext {

// All vectors are parallel to `views`. Image ids are 1, 2, ...
struct RenderedScene {
  std::vector<phi::SceneView> views;
  std::vector<std::shared_ptr<const phi::GrayImage>> images;
  std::vector<std::shared_ptr<const phi::PlaneMap>> truth;  // exact, at the pixel centres
  std::vector<std::shared_ptr<const phi::Mask>> textured;   // 255 = textured, 0 = painted
  std::vector<std::shared_ptr<const phi::Array2D<SurfaceId>>> surfaces;

  phi::ViewImage Image(int view) const { return {&views[view], images[view]}; }
  // All other views, in order.
  std::vector<phi::ViewImage> SourceImages(int reference) const;
  std::vector<phi::SourceMap> SourceTruth(int reference) const;
};

// Per pixel of view `reference`, how many other views see the same surface point: it projects inside them and
// their exact depth there (nearest pixel) agrees within 1 %.
phi::Array2D<int> CountOtherViews(const RenderedScene& scene, int reference);

// X_new = scale * rotation * X_old + translation.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation{0, 0, 0};

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return scale * (rotation * x) + translation; }
};

phi::Pose Transformed(const phi::Pose& pose, const Similarity& new_from_old);
phi::PlaneMap Scaled(const phi::PlaneMap& map, double scale);

// The same images of the moved world: poses change, depths are scaled.
void Transform(const Similarity& new_from_old, RenderedScene* scene);

}  // namespace colmap_ext
