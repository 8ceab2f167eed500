#include "phi/inference/image_plane.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace phi {

void PlaneFit::Solve(ImagePlane* plane) const {
  const Eigen::Matrix3d normal{{sum_, x_, y_}, {x_, xx_, xy_}, {y_, xy_, yy_}};
  const Eigen::Vector3d solution = normal.ldlt().solve(Eigen::Vector3d(w_, wx_, wy_));
  plane->b = solution(1);
  plane->c = solution(2);
  plane->a = solution(0) - solution(1) * cx_ - solution(2) * cy_;
}

Eigen::Matrix2d PlaneFit::Covariance() const {
  return Eigen::Matrix2d{{xx_, xy_}, {xy_, yy_}} / sum_ - RelativeMean() * RelativeMean().transpose();
}

// Eigen's solver for it took 7 s of the compiler's time.
double PlaneFit::NarrowVariance() const {
  const Eigen::Matrix2d covariance = Covariance();
  const double xx = covariance(0, 0), xy = covariance(0, 1), yy = covariance(1, 1);
  return (xx + yy) / 2 - std::hypot((xx - yy) / 2, xy);
}

}  // namespace phi
