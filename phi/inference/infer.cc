#include "phi/inference/infer.h"

#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/cancellation.h"
#include "phi/inference/field.h"
#include "phi/inference/hypotheses.h"
#include "phi/inference/hypothesis_matcher.h"
#include "phi/inference/infer_setup.h"
#include "phi/inference/region_pixels.h"
#include "phi/inference/trws.h"
#include "phi/inference/upsample.h"

namespace phi {
namespace {

// Inverse depth per pixel, 0 where a hole stays a hole.
using InverseDepthMap = Array2D<float>;

// function(context, x, y) for each pixel.
template <typename T, typename Function>
Array2D<T> ForPixels(const HypothesisMatcher& matcher, const Function& function) {
  const ArrayView2D<const float> evidence = HypothesisMatcher::Context(matcher).state.evidence;
  auto result = Array2D<T>::Uninitialized(evidence.width, evidence.height);
  tbb::parallel_for(0, result.height(), [&](int y) {
    const HypothesisMatcher::Context context(matcher);
    for (int x = 0; x < result.width(); ++x) result(x, y) = function(context, x, y);
  });
  return result;
}

// Each hole's hypothesis of lowest cost, at full size (the paper's PHI-MVS/M).
InverseDepthMap ChooseMinCost(const HypothesisMatcher& matcher) {
  return ForPixels<float>(
      matcher, [](const auto& context, int x, int y) { return CheapestInverseDepth(context, x, y); });
}

// The hypotheses that the field chose, at full size.
InverseDepthMap Upsample(const HypothesisMatcher& matcher, const Array2D<float>& chosen) {
  return ForPixels<float>(matcher, [&](const auto& context, int x, int y) {
    return UpsampledInverseDepth(context.state, chosen.view(), context.parameters.method.formulas, x, y);
  });
}

InverseDepthMap ChooseByField(const HypothesisMatcher& matcher, const InferenceOptions& options,
                              FieldStatistics* statistics) {
  const Field field(matcher, options);
  const TrwsResult solution = SolveTrws(field.view(), options.num_passes);
  *statistics = field.counts();
  statistics->energy = solution.energy * kNatsPerEnergyUnit;
  statistics->lower_bound = solution.lower_bounds.back() * kNatsPerEnergyUnit;
  const std::vector<std::uint8_t> min_cost_labels = MinUnaryLabels(field.view());
  statistics->min_cost_energy = FieldEnergy(field.view(), min_cost_labels) * kNatsPerEnergyUnit;
  for (std::size_t i = 0; i < min_cost_labels.size(); ++i) {
    statistics->num_unlike_min_cost += solution.labels[i] != min_cost_labels[i];
  }
  return Upsample(matcher, field.ChosenInverseDepth(solution.labels));
}

// The measured map's evidence and the inferred depths, with their normals and states.
MeasurementMap Compose(const PlaneMap& measured, const HypothesisMatcher& matcher,
                       const InverseDepthMap& inferred) {
  MeasurementMap result;
  result.states = ForPixels<PixelState>(matcher, [&](const auto& context, int x, int y) {
    return StateAfterInference(context, x, y, inferred(x, y));
  });
  const InverseDepthMap all = ForPixels<float>(matcher, [&](const auto& context, int x, int y) {
    return context.state.IsHole(x, y) ? inferred(x, y) : context.state.evidence(x, y);
  });
  result.planes = ForPixels<PlaneHypothesis>(matcher, [&](const auto& context, int x, int y) {
    const PlaneHypothesis evidence = context.state.IsHole(x, y) ? PlaneHypothesis() : measured(x, y);
    return ComposedPlane(context.parameters, evidence, inferred(x, y), all.view(), x, y);
  });
  return result;
}

Hypotheses MakeHypotheses(const InferenceInput& input, const Method& method) {
  if (method.formulas == Formulas::kPaper) return Hypotheses(*input.measured, method);
  Array2D<float> anchors = AnchorMap(*input.measured, method.formulas);
  RegionPlanes planes = FindRegionPlanes(input, RegionsOf(input, method.rules), std::as_const(anchors).view(), method.rules);
  return {*input.measured, method.rules, *input.reference.image, std::move(anchors), std::move(planes)};
}

}  // namespace

InferenceResult InferPlanes(const InferenceInput& input, const StereoOptions& stereo,
                            const InferenceOptions& options) {
  CheckInferenceInput(input);
  const MeasurementMap& measured = *input.measured;
  if (options.mode == InferenceMode::kOff) return {measured, {}};
  const Hypotheses hypotheses = MakeHypotheses(input, options.method);
  ThrowIfCancelled();
  const HypothesisMatcher matcher(input, hypotheses, stereo, options.method);
  InferenceResult result;
  const InverseDepthMap inferred = options.mode == InferenceMode::kMinCost
                                 ? ChooseMinCost(matcher)
                                 : ChooseByField(matcher, options, &result.statistics);
  ThrowIfCancelled();
  result.map = Compose(measured.planes, matcher, inferred);
  if (hypotheses.region_planes() != nullptr) {
    FinishRegionPixels(*hypotheses.region_planes(), input, options.method.rules, &result.map);
  }
  return result;
}

}  // namespace phi
