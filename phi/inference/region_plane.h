// A plane, or a bent surface, that fills pixels of a region, and how far it reaches.
#pragma once

#include <array>

#include <Eigen/Core>

#include "phi/inference/image_plane.h"
#include "phi/inference/line_hypothesis.h"
#include "phi/inference/plane_fit.h"

namespace phi {

// Within an ellipse around what carries the plane: the sides of a building carry one, and the sky that the building stands
// before is no part of it.
struct RegionPlane : ImagePlane {
  // The ellipse: q = (x - center_x, y - center_y), xx * q.x^2 + 2 * xy * q.x * q.y + yy * q.y^2 <= 1.
  double center_x = 0, center_y = 0, xx = 0, xy = 0, yy = 0;
  // What is added to the plane's inverse depth: xx * d.x^2 + xy * d.x * d.y + yy * d.y^2, d = (x, y) less the bend's own centre.
  struct Bend {
    double center_x = 0, center_y = 0, xx = 0, xy = 0, yy = 0;
  } bend = {};

  bool IsThere() const { return xx > 0; }

  // So many standard deviations around the mean of places with that covariance.
  void SetReach(const Eigen::Vector2d& mean, const Eigen::Matrix2d& covariance, double deviations);

  // Hides the plane's.
  double InverseDepth(double x, double y) const {
    const double dx = x - bend.center_x, dy = y - bend.center_y;
    return ImagePlane::InverseDepth(x, y) + (bend.xx * dx + bend.xy * dy) * dx + bend.yy * dy * dy;
  }

  // The plane that touches the surface at (x, y).
  InverseDepthPlane Around(int x, int y) const {
    const double dx = x - bend.center_x, dy = y - bend.center_y;
    return {static_cast<float>(InverseDepth(x, y)), static_cast<float>(b + 2 * bend.xx * dx + bend.xy * dy),
            static_cast<float>(c + bend.xy * dx + 2 * bend.yy * dy), 1};
  }

  // 0 outside the ellipse.
  float At(int x, int y) const {
    if (!IsThere()) return 0;
    const double dx = x - center_x, dy = y - center_y;
    if (xx * dx * dx + (2 * xy * dx + yy * dy) * dy > 1) return 0;
    const double w = InverseDepth(x, y);
    return w > 0 ? static_cast<float>(w) : 0;
  }
};

// Up to so many; the others are not there.
using PlanesOfRegion = std::array<RegionPlane, kPlanesPerRegion>;

}  // namespace phi
