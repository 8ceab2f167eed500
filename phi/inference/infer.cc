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
#include "phi/inference/trws.h"
#include "phi/inference/upsample.h"

namespace phi {
namespace {

// Inverse depth per pixel, 0 where a hole stays a hole.
using InverseDepthMap = Array2D<float>;

// Each hole's hypothesis of lowest cost, at full size (the paper's PHI-MVS/M).
InverseDepthMap ChooseMinCost(const Hypotheses& hypotheses, const HypothesisMatcher& matcher) {
  const HypothesisMaps maps = hypotheses.maps();
  InverseDepthMap result(maps.inverse_depth[0].width, maps.inverse_depth[0].height, 0.0f);
  tbb::parallel_for(0, result.height(), [&](int y) {
    HypothesisMatcher::Scratch scratch;
    for (int x = 0; x < result.width(); ++x) {
      if (hypotheses.measured(x, y)) continue;
      float costs[kNumDirections];
      const std::uint8_t allowed = matcher.Costs(x, y, &scratch, costs);
      int best = -1;
      for (int k = 0; k < kNumDirections; ++k) {
        if ((allowed >> k & 1) && (best < 0 || costs[k] < costs[best])) best = k;
      }
      if (best >= 0) result(x, y) = maps.inverse_depth[best](x, y);
    }
  });
  return result;
}

InverseDepthMap ChooseByField(const Hypotheses& hypotheses, const HypothesisMatcher& matcher,
                              const InferenceOptions& options, FieldStatistics* statistics) {
  const Field field(hypotheses, matcher, options);
  const TrwsResult solution = SolveTrws(field.view(), options.num_passes);
  constexpr double kNats = 1.0 / kEnergyUnitsPerNat;
  statistics->num_nodes = field.num_nodes();
  statistics->energy = solution.energy * kNats;
  statistics->lower_bound = solution.lower_bounds.back() * kNats;
  statistics->min_cost_energy = FieldEnergy(field.view(), MinUnaryLabels(field.view())) * kNats;

  const Array2D<float> chosen = field.ChosenInverseDepth(solution.labels);
  const HypothesisMaps maps = hypotheses.maps();
  InverseDepthMap result(maps.inverse_depth[0].width, maps.inverse_depth[0].height, 0.0f);
  tbb::parallel_for(0, result.height(), [&](int y) {
    for (int x = 0; x < result.width(); ++x) {
      if (!hypotheses.measured(x, y)) result(x, y) = UpsampleHypothesis(maps, chosen.view(), x, y);
    }
  });
  return result;
}

// Adds the inferred depths and their normals to the measured map.
InferenceResult Compose(const PlaneMap& measured, const InverseDepthMap& inferred, const RayModel& rays,
                        Formulas formulas) {
  InferenceResult result;
  result.map = measured;
  result.filled = Mask(measured.width(), measured.height(), 0);
  InverseDepthMap all = inferred;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const float depth = measured.data()[i].depth;
    if (depth > 0) all.data()[i] = 1 / depth;
  }
  const ArrayView2D<const float> all_view = std::as_const(all).view();
  tbb::parallel_for(0, all.height(), [&](int y) {
    for (int x = 0; x < all.width(); ++x) {
      const float w = inferred(x, y);
      if (!(w > 0)) continue;
      result.map(x, y).normal = FilledNormal(rays, all_view, x, y, formulas == Formulas::kPaper);
      result.map(x, y).depth = 1 / w;
      result.filled(x, y) = 255;
    }
  });
  return result;
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
  const PlaneMap& measured = *input.measured;
  InverseDepthMap inferred(measured.width(), measured.height(), 0.0f);
  FieldStatistics statistics;
  if (options.mode != InferenceMode::kOff) {
    const Hypotheses hypotheses(measured, options.formulas, input.reference.image.get(),
                                input.reference.view->image_id);
    ThrowIfCancelled();
    const HypothesisMatcher matcher(input, hypotheses, stereo, options.formulas);
    inferred = options.mode == InferenceMode::kMinCost
                   ? ChooseMinCost(hypotheses, matcher)
                   : ChooseByField(hypotheses, matcher, options, &statistics);
    ThrowIfCancelled();
  }
  InferenceResult result =
      Compose(measured, inferred, MakeRayModel(input.reference.view->camera.pinhole), options.formulas);
  result.statistics = statistics;
  return result;
}

}  // namespace phi
