#include "phi/filtering/filter_setup.h"

#include <cmath>

namespace phi {

ConsistencyThresholds MakeConsistencyThresholds(const FilterOptions& options) {
  constexpr double kRadianPerDegree = 3.14159265358979323846 / 180;
  ConsistencyThresholds t;
  t.max_reprojection_error = static_cast<float>(options.max_reprojection_error);
  t.max_relative_depth_error = static_cast<float>(options.max_relative_depth_error);
  t.min_normal_cosine = static_cast<float>(std::cos(options.max_normal_error * kRadianPerDegree));
  t.max_ray_cosine = options.min_triangulation_angle > 0
                         ? static_cast<float>(std::cos(options.min_triangulation_angle * kRadianPerDegree))
                         : 1.0f;
  t.paper = options.formulas == Formulas::kPaper;
  return t;
}

}  // namespace phi
