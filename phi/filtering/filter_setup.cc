#include "phi/filtering/filter_setup.h"

#include <cmath>

#include "phi/geometry/camera.h"
#include "phi/matching/zncc.h"

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

FilterContext::FilterContext(const FilterInput& input, const FilterOptions& options)
    : reference(MakeRayModel(input.reference.view->camera.pinhole)),
      thresholds(MakeConsistencyThresholds(options)),
      min_num_consistent(options.min_num_consistent),
      min_num_consistent_inferred(options.min_num_consistent_inferred),
      max_cost(static_cast<float>(options.max_cost)),
      map(input.reference.map->view()) {
  if (input.cost != nullptr && options.max_cost < kMaxCost) cost = input.cost->view();
  if (input.filled != nullptr) filled = input.filled->view();
  for (const ViewMap& source : input.sources) {
    if (source.map == nullptr) continue;
    views.push_back(MakeRelativeView(input.reference.view->camera, source.view->camera));
    source_maps.push_back(source.map->view());
  }
}

bool FilterContext::Keeps(int x, int y) const {
  const PlaneHypothesis& h = map(x, y);
  if (!(h.depth > 0)) return false;
  const std::uint8_t inferred = filled.data != nullptr ? filled(x, y) : 0;
  if (cost.data != nullptr && inferred == 0 && cost(x, y) > max_cost) return false;
  const int required = RequiredViews(inferred, min_num_consistent, min_num_consistent_inferred);
  int num_consistent = 0;
  for (std::size_t j = 0; j < views.size() && num_consistent < required; ++j) {
    num_consistent += IsConsistent(reference, views[j], x + 0.5f, y + 0.5f, h, source_maps[j], thresholds);
  }
  return num_consistent >= required;
}

}  // namespace phi
