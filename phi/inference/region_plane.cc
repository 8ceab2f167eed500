#include "phi/inference/region_plane.h"

#include <Eigen/LU>

namespace phi {

void RegionPlane::SetReach(const Eigen::Vector2d& mean, const Eigen::Matrix2d& covariance, double deviations) {
  const Eigen::Matrix2d ellipse = covariance.inverse() / (deviations * deviations);
  center_x = mean.x();
  center_y = mean.y();
  xx = ellipse(0, 0);
  xy = ellipse(0, 1);
  yy = ellipse(1, 1);
}

}  // namespace phi
