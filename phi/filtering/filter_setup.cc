#include "phi/filtering/filter_setup.h"

#include <tbb/parallel_for.h>

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
  t.max_depth_error = static_cast<float>(options.max_depth_error);
  t.formulas = options.formulas;
  return t;
}

FilterReference MakeFilterReference(const FilterInput& input, const FilterOptions& options) {
  FilterReference f{.rays = MakeRayModel(input.reference.view->camera.pinhole),
                    .thresholds = MakeConsistencyThresholds(options),
                    .min_num_consistent = options.min_num_consistent,
                    .min_num_consistent_inferred = options.min_num_consistent_inferred,
                    .max_cost = static_cast<float>(1 - options.min_ncc),
                    .map = input.reference.map->view()};
  if (input.cost != nullptr && options.UsesCost()) f.cost = input.cost->view();
  if (input.filled != nullptr) f.filled = input.filled->view();
  return f;
}

std::vector<SourceMap> SourcesWithMap(const FilterInput& input) {
  std::vector<SourceMap> sources;
  for (const SourceMap& source : input.sources) {
    if (source.load != nullptr) sources.push_back(source);
  }
  return sources;
}

FilterResult KeptPixels(const PlaneMap& map, const FilterVerdict* verdicts) {
  FilterResult result{PlaneMap::Uninitialized(map.width(), map.height()),
                      Mask::Uninitialized(map.width(), map.height())};
  const ArrayView2D<const FilterVerdict> verdict{verdicts, map.width(), map.height()};
  tbb::parallel_for(0, map.height(), [&](int y) {
    for (int x = 0; x < map.width(); ++x) {
      result.map(x, y) = verdict(x, y) != FilterVerdict::kDropped ? map(x, y) : PlaneHypothesis();
      result.few_witnesses(x, y) = verdict(x, y) == FilterVerdict::kFewWitnesses ? 255 : 0;
    }
  });
  return result;
}

}  // namespace phi
