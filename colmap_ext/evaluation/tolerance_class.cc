#include "colmap_ext/evaluation/tolerance_class.h"

#include <cmath>

namespace colmap_ext {

std::string CheckTolerances(const std::vector<double>& tolerances) {
  if (tolerances.empty()) return "--tolerances must name at least one distance, as in 0.01,0.02,0.05";
  if (tolerances.size() > kMaxTolerances) {
    return "--tolerances takes at most " + std::to_string(kMaxTolerances) + " distances";
  }
  double previous = 0;
  for (double tolerance : tolerances) {
    if (!std::isfinite(tolerance) || tolerance <= previous) {
      return "--tolerances must be positive and ascending, as in 0.01,0.02,0.05";
    }
    previous = tolerance;
  }
  return "";
}

}  // namespace colmap_ext
