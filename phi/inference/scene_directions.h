// Three directions at right angles that most planes of a scene stand along, as walls, floors and furniture do (a Manhattan world:
// Coughlan and Yuille 1999).
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "phi/geometry/camera.h"
#include "phi/inference/image_plane.h"
#include "phi/inference/scene_planes.h"

namespace phi {

class SceneDirections {
 public:
  static constexpr int kCount = 3;

  // A direction in each column, in the frame of the camera whose images have that `pinhole`.
  SceneDirections(const Eigen::Matrix3d& directions, const Pinhole& pinhole) : directions_(directions), pinhole_(pinhole) {}

  const Eigen::Matrix3d& columns() const { return directions_; }

  // At distance 1 from the camera; the planes at other distances are its multiples.
  ImagePlane PlaneAlong(int direction) const;

  // Of the plane's normal from the nearest direction, radian.
  double AngleTo(const ImagePlane& plane) const;

 private:
  Eigen::Matrix3d directions_;
  Pinhole pinhole_;
};

// None where the planes' cells lie for the most part on planes that stand otherwise. `pinhole`: of the planes' image.
std::optional<SceneDirections> FindDirections(std::span<const CarriedPlane> planes, const Pinhole& pinhole);

}  // namespace phi
