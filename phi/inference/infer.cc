#include "phi/inference/infer.h"

#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/cancellation.h"
#include "phi/base/error.h"
#include "phi/inference/field.h"
#include "phi/inference/hypotheses.h"
#include "phi/inference/hypothesis_matcher.h"
#include "phi/inference/plane_normal.h"
#include "phi/inference/pooled_supports.h"
#include "phi/inference/trws.h"
#include "phi/inference/upsample.h"

namespace phi {
namespace {

// Inverse depth per pixel, 0 where a hole stays a hole.
using InverseDepthMap = Array2D<float>;

// Each hole's hypothesis of lowest cost, at full size (the paper's PHI-MVS/M).
InverseDepthMap ChooseMinCost(const Hypotheses& hypotheses, const HypothesisMatcher& matcher) {
  const HypothesisMaps maps = hypotheses.maps();
  auto result = InverseDepthMap::Uninitialized(maps.inverse_depth[0].width, maps.inverse_depth[0].height);
  tbb::parallel_for(0, result.height(), [&](int y) {
    HypothesisMatcher::Scratch scratch;
    for (int x = 0; x < result.width(); ++x) {
      result(x, y) = 0;
      if (hypotheses.measured(x, y)) continue;
      const int best = matcher.Costs(x, y, &scratch).Cheapest();
      if (best >= 0) result(x, y) = maps.inverse_depth[best](x, y);
    }
  });
  return result;
}

// The hypotheses that the field chose, at full size.
InverseDepthMap Upsample(const Hypotheses& hypotheses, const Array2D<float>& chosen, Formulas formulas) {
  const HypothesisMaps maps = hypotheses.maps();
  auto result = InverseDepthMap::Uninitialized(maps.inverse_depth[0].width, maps.inverse_depth[0].height);
  tbb::parallel_for(0, result.height(), [&](int y) {
    for (int x = 0; x < result.width(); ++x) {
      result(x, y) = 0;
      if (hypotheses.measured(x, y)) continue;
      const int k = UpsampleHypothesis(maps, chosen.view(), formulas, x, y);
      if (k >= 0) result(x, y) = maps.inverse_depth[k](x, y);
    }
  });
  return result;
}

InverseDepthMap ChooseByField(const Hypotheses& hypotheses, const HypothesisMatcher& matcher,
                              const InferenceOptions& options, FieldStatistics* statistics) {
  const Field field(hypotheses, matcher, options);
  const TrwsResult solution = SolveTrws(field.view(), options.num_passes);
  constexpr double kNats = 1.0 / kEnergyUnitsPerNat;
  *statistics = field.counts();
  statistics->energy = solution.energy * kNats;
  statistics->lower_bound = solution.lower_bounds.back() * kNats;
  const std::vector<std::uint8_t> min_cost_labels = MinUnaryLabels(field.view());
  statistics->min_cost_energy = FieldEnergy(field.view(), min_cost_labels) * kNats;
  for (std::size_t i = 0; i < min_cost_labels.size(); ++i) {
    statistics->num_unlike_min_cost += solution.labels[i] != min_cost_labels[i];
  }

  return Upsample(hypotheses, field.ChosenInverseDepth(solution.labels), options.formulas);
}

// What becomes of an inferred depth; kNone where another view sees through it.
PixelState InferredState(const HypothesisMatcher& matcher, Formulas formulas, int x, int y, float w) {
  if (formulas == Formulas::kPaper) return PixelState::kInferredConfirmed;
  return matcher.Evidence(x, y, w).State();
}

// The states of the new map. Drops the inferred depths that other views see through.
StateMap JudgeInferred(const Hypotheses& hypotheses, const HypothesisMatcher& matcher, Formulas formulas,
                       InverseDepthMap* inferred) {
  auto states = StateMap::Uninitialized(inferred->width(), inferred->height());
  tbb::parallel_for(0, states.height(), [&](int y) {
    for (int x = 0; x < states.width(); ++x) {
      states(x, y) = hypotheses.measured(x, y) ? PixelState::kMeasured : PixelState::kNone;
      float& w = (*inferred)(x, y);
      if (!(w > 0)) continue;
      states(x, y) = InferredState(matcher, formulas, x, y, w);
      if (states(x, y) == PixelState::kNone) w = 0;
    }
  });
  return states;
}

// The planes of what is evidence, and of the inferred depths with their normals.
PlaneMap Compose(const MeasurementMap& measured, const InverseDepthMap& inferred, const RayModel& rays,
                 Formulas formulas) {
  const int width = measured.width(), height = measured.height();
  auto all = InverseDepthMap::Uninitialized(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      all(x, y) = IsEvidence(measured.states(x, y)) ? 1 / measured.planes(x, y).depth : inferred(x, y);
    }
  });
  const ArrayView2D<const float> all_view = std::as_const(all).view();
  auto result = PlaneMap::Uninitialized(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      PlaneHypothesis& h = result(x, y) = {};
      if (IsEvidence(measured.states(x, y))) h = measured.planes(x, y);
      const float w = inferred(x, y);
      if (!(w > 0)) continue;
      h.normal = FilledNormal(rays, all_view, x, y, formulas);
      h.depth = 1 / w;
    }
  });
  return result;
}

Hypotheses MakeHypotheses(const InferenceInput& input, Formulas formulas) {
  std::vector<PooledSupport> pooled;
  if (formulas == Formulas::kRobust) pooled = PoolSupports(input);
  return Hypotheses(*input.measured, formulas, RegionImage(input).get(), input.reference.view->image_id,
                    pooled, PrecisionOf(input));
}

void CheckInput(const InferenceInput& input) {
  const auto& image = input.reference.image;
  if (!image || !input.measured || input.reference.view == nullptr ||
      image->width() != input.measured->width() || image->height() != input.measured->height()) {
    throw InputError("plane inference of image " +
                     (input.reference.view != nullptr ? input.reference.view->name : std::string("?")) +
                     ": the depth map's size differs from the image's; run patch_match_stereo again");
  }
}

}  // namespace

InferenceResult InferPlanes(const InferenceInput& input, const StereoOptions& stereo,
                            const InferenceOptions& options) {
  CheckInput(input);
  const MeasurementMap& measured = *input.measured;
  if (options.mode == InferenceMode::kOff) return {measured, {}};
  const Hypotheses hypotheses = MakeHypotheses(input, options.formulas);
  ThrowIfCancelled();
  const HypothesisMatcher matcher(input, hypotheses, stereo, options.formulas);
  InferenceResult result;
  InverseDepthMap inferred = options.mode == InferenceMode::kMinCost
                                 ? ChooseMinCost(hypotheses, matcher)
                                 : ChooseByField(hypotheses, matcher, options, &result.statistics);
  ThrowIfCancelled();
  result.map.states = JudgeInferred(hypotheses, matcher, options.formulas, &inferred);
  const RayModel rays = MakeRayModel(input.reference.view->camera.pinhole);
  result.map.planes = Compose(measured, inferred, rays, options.formulas);
  if (hypotheses.region_planes() != nullptr) SetRegionNormals(*hypotheses.region_planes(), rays, &result.map);
  return result;
}

}  // namespace phi
