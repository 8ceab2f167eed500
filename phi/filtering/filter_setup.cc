#include "phi/filtering/filter_setup.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "phi/base/error.h"
#include "phi/base/message.h"
#include "phi/base/whole_array.h"
#include "phi/geometry/camera.h"
#include "phi/matching/zncc.h"

namespace phi {
namespace {

PixelState StateAfter(FilterVerdict verdict, bool was_inferred) {
  if (verdict == FilterVerdict::kDropped) return PixelState::kNone;
  return was_inferred ? PixelState::kInferredConfirmed : PixelState::kMeasured;
}

// The planes of the pixels whose state is not kNone. state_of(i): of pixel i.
template <typename Function>
MeasurementMap PixelsWithState(const PlaneMap& planes, const Function& state_of) {
  MeasurementMap kept{PlaneMap::Uninitialized(planes.width(), planes.height()),
                      StateMap::Uninitialized(planes.width(), planes.height())};
  ForParts(planes.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const PixelState state = state_of(i);
      kept.planes.data()[i] = state != PixelState::kNone ? planes.data()[i] : PlaneHypothesis();
      kept.states.data()[i] = state;
    }
  });
  return kept;
}

void CheckJudgement(const Judgement& judgement, const ViewMap& estimate) {
  const bool has_image = judgement.image != nullptr && judgement.image->width() == estimate.map->width() &&
                         judgement.image->height() == estimate.map->height();
  if (!has_image || !estimate.map->states.empty())
    throw UsageError("image " + AboutImage(estimate.view->name) + ": an estimate alone is judged, by an image of its size");
}

constexpr double kPi = std::numbers::pi, kRadianPerDegree = kPi / 180;

// Of an angle so many times as wide.
float ScaledCosine(float cosine, double scale) {
  return static_cast<float>(std::cos(std::min(kPi, scale * std::acos(static_cast<double>(cosine)))));
}

void ApplyRules(const Rules& rules, ConsistencyThresholds* t) {
  constexpr float kPaperDepthError = 0.02f;  // world units
  constexpr double kPaperNormalError = 30;   // degrees
  const float one_surface = rules.Factor(Rule::kOneSurfaceDepth),
              tolerances = rules.Factor(Rule::kFilterTolerances);
  t->same_depth = one_surface > 0 ? one_surface * t->same_depth : std::numeric_limits<float>::infinity();
  if (tolerances > 0) {
    t->max_relative_depth_error *= tolerances;
    if (tolerances != 1) t->min_normal_cosine = ScaledCosine(t->min_normal_cosine, tolerances);
  } else {
    t->max_depth_error = kPaperDepthError;
    t->min_normal_cosine = static_cast<float>(std::cos(kPaperNormalError * kRadianPerDegree));
  }
  // Off: only the verdict is another; the probability rests on the same testimonies.
  const float few = rules.Scale(Rule::kFewViews);
  t->close_depth *= few;
  t->close_reprojection *= few;
  t->window_reach *= few;
  t->depth_gap *= few;
  t->min_facing_cosine = ScaledCosine(t->min_facing_cosine, few);
  t->min_rays_cosine = ScaledCosine(t->min_rays_cosine, few);
}

// Pixels.
float MaxReprojectionErrorInferred(const FilterOptions& options) {
  const bool is_asked = options.method.FormulasOf(Rule::kFilterTolerances) == Formulas::kPaper;
  return is_asked ? static_cast<float>(options.max_reprojection_error) : std::numeric_limits<float>::infinity();
}

float MaxEmptyRatio(const FilterOptions& options) {
  constexpr float kEmptyViewsForEach = 2;
  // Who asks for no view's word gets what was filled.
  const bool is_asked =
      options.min_num_consistent_inferred > 0 && options.method.FormulasOf(Rule::kEmptyViews) == Formulas::kRobust;
  return is_asked ? options.method.rules.Scale(Rule::kEmptyViews) * kEmptyViewsForEach : 0;
}

}  // namespace

ConsistencyThresholds MakeConsistencyThresholds(const FilterOptions& options) {
  ConsistencyThresholds t;
  t.max_reprojection_error = static_cast<float>(options.max_reprojection_error);
  t.max_relative_depth_error = static_cast<float>(options.max_relative_depth_error);
  t.min_normal_cosine = static_cast<float>(std::cos(options.max_normal_error * kRadianPerDegree));
  t.max_ray_cosine = options.min_triangulation_angle > 0
                         ? static_cast<float>(std::cos(options.min_triangulation_angle * kRadianPerDegree))
                         : 1.0f;
  t.max_depth_error = static_cast<float>(options.max_depth_error);
  t.formulas = options.method.formulas;
  ApplyRules(options.method.rules, &t);
  return t;
}

FilterReference MakeFilterReference(const FilterInput& input, const FilterOptions& options) {
  if (input.judgement) CheckJudgement(*input.judgement, input.reference);
  FilterReference f{.rays = MakeRayModel(input.reference.view->camera.pinhole),
                    .thresholds = MakeConsistencyThresholds(options),
                    .max_reprojection_error_inferred = MaxReprojectionErrorInferred(options),
                    .min_num_consistent = options.min_num_consistent,
                    .min_num_consistent_inferred = options.min_num_consistent_inferred,
                    .max_empty_ratio = MaxEmptyRatio(options),
                    .max_cost = static_cast<float>(1 - options.min_ncc),
                    .accepts_few_views = options.method.FormulasOf(Rule::kFewViews) == Formulas::kRobust,
                    .map = input.reference.map->planes.view()};
  if (input.cost != nullptr && options.UsesCost()) f.cost = input.cost->view();
  if (!input.reference.map->states.empty()) f.states = input.reference.map->states.view();
  return f;
}

std::vector<SourceMap> SourcesWithMap(const FilterInput& input) {
  std::vector<SourceMap> sources;
  for (const SourceMap& source : input.sources) {
    if (source.load != nullptr) sources.push_back(source);
  }
  return sources;
}

MeasurementMap KeptPixels(const MeasurementMap& map, const FilterVerdict* verdicts) {
  return PixelsWithState(map.planes, [&](std::size_t i) {
    return StateAfter(verdicts[i], !map.states.empty() && IsInferred(map.states.data()[i]));
  });
}

MeasurementMap JudgedPixels(const PlaneMap& estimate, const PixelState* states) {
  return PixelsWithState(estimate, [states](std::size_t i) { return states[i]; });
}

}  // namespace phi
