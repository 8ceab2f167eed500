#include "phi/matching/estimation_setup.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "phi/base/error.h"
#include "phi/base/median.h"
#include "phi/matching/matching_window.h"
#include "phi/matching/pyramid.h"
#include "phi/matching/window_level.h"

namespace phi {
namespace {

// The change of inverse depth that moves a match by one pixel, for the median source view. Displacement is
// about f_source * baseline * change, where the baseline is taken across the line of sight.
float InverseDepthPerPixel(const EstimationInput& input, const std::vector<RelativeView>& views) {
  std::vector<double> per_pixel;
  for (const RelativeView& view : views) {
    const double across = std::hypot(view.translation.x, view.translation.y);
    const double along =
        0.2 * std::abs(view.translation.z);  // forward motion moves pixels off the centre only
    const double baseline = std::max({across, along, 1e-6 * input.depth_max});
    per_pixel.push_back(1.0 / (view.source.fx * baseline));
  }
  return static_cast<float>(Median(&per_pixel));
}

int NumWindowLevels(const Pinhole& size, const StereoOptions& options) {
  if (!options.method.rules.IsOn(Rule::kReducedImages)) return 1;
  return NumLevels(size, options.method.rules.Count(Rule::kReducedImages, kMinLevelSide), options.num_window_levels);
}

}  // namespace

void CheckEstimationInput(const EstimationInput& input) {
  const Message image = "image '" + AboutImage(input.reference.view->name) + "', estimation: ";
  if (input.sources.empty()) {
    throw InputError(image +
                     "no source view; list some in stereo/patch-match.cfg or add images that overlap");
  }
  if (input.sources.size() > static_cast<std::size_t>(kMaxSourceViews)) {
    throw InputError(image + std::to_string(input.sources.size()) + " source views, but at most " +
                     std::to_string(kMaxSourceViews) + " are supported; use '__auto__, " +
                     std::to_string(kMaxSourceViews) + "' in stereo/patch-match.cfg");
  }
  if (!(input.depth_min > 0) || !(input.depth_max > input.depth_min)) {
    throw InputError(image + "the depth range [" + std::to_string(input.depth_min) + ", " +
                     std::to_string(input.depth_max) +
                     "] is empty; set --PatchMatchStereo.depth_min and --PatchMatchStereo.depth_max");
  }
}

std::vector<RelativeView> MakeRelativeViews(const EstimationInput& input) {
  std::vector<RelativeView> views;
  for (const ViewImage& source : input.sources) {
    views.push_back(MakeRelativeView(input.reference.view->camera, source.view->camera));
  }
  return views;
}

float FarthestSearched(float depth_max, bool depth_range_is_given, const Method& method) {
  const bool is_bounded = depth_range_is_given || method.FormulasOf(Rule::kDepthBounds) == Formulas::kRobust;
  return is_bounded ? depth_max : std::numeric_limits<float>::max();
}

EstimationParameters MakeEstimationParameters(const EstimationInput& input, const StereoOptions& options) {
  CheckEstimationInput(input);
  EstimationParameters p;
  p.reference = MakeRayModel(input.reference.view->camera.pinhole);
  p.window = MakeMatchingWindow(options);
  // One fixed window on request (one level).
  const Rules& rules = options.method.rules;
  if (options.num_window_levels > 1 && p.window.step > kNarrowStep && rules.IsOn(Rule::kNarrowWindows)) {
    p.window.narrow_step = kNarrowStep;
    p.window.narrow_variance = NarrowWindowVariance(input.noise, rules.Factor(Rule::kNarrowWindows));
  }
  p.window.level_variance = LevelVariance(input.noise, rules.Scale(Rule::kReducedImages));
  const float half_weight = rules.Scale(Rule::kSampleWeights) * kHalfWeightDifference;
  const bool has_weights = options.method.FormulasOf(Rule::kSampleWeights) == Formulas::kRobust;
  p.window.weight_decay = has_weights ? 1.0f / (half_weight * half_weight) : 0.0f;
  p.window.range_follows_texture = !input.is_reduced;
  p.key = {options.seed, input.reference.view->image_id};
  p.depth_min = input.depth_min;
  p.depth_max = input.depth_max;
  // Sparse points tell how far surfaces reach. Nearer ones may have none: the lawn before a house, a table's top.
  p.nearest = input.depth_range_is_given ? p.depth_min : std::numeric_limits<float>::min();
  p.farthest = FarthestSearched(p.depth_max, input.depth_range_is_given, options.method);
  p.inverse_depth_per_pixel = InverseDepthPerPixel(input, MakeRelativeViews(input));
  p.num_views = static_cast<int>(input.sources.size());
  p.num_iterations = options.num_iterations;
  p.end_iteration = options.num_iterations;
  p.num_levels = NumWindowLevels(input.reference.view->camera.pinhole, options);
  p.view_mean = ChooseViewMean(options.method, input.is_reduced);
  p.method = options.method;
  p.ranks = p.method.FormulasOf(Rule::kSparseRanking) == Formulas::kRobust &&
            p.window.samples_per_side >= kMinSideForSparse;
  return p;
}

}  // namespace phi
