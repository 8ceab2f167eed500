#include "phi/matching/coarse_start.h"

#include <algorithm>
#include <array>

#include "phi/matching/estimation_setup.h"
#include "phi/matching/pyramid.h"

namespace phi {
namespace {

// K's coordinates halve exactly; odd sizes are rounded up as HalveImage does.
Pinhole Halve(Pinhole k) {
  k.width = (k.width + 1) / 2;
  k.height = (k.height + 1) / 2;
  for (double* value : {&k.fx, &k.fy, &k.cx, &k.cy}) *value *= 0.5;
  return k;
}

SceneView ReduceView(SceneView view, int level) {
  for (int i = 0; i < level; ++i) view.camera.pinhole = Halve(view.camera.pinhole);
  return view;
}

// Iterations at a level, in eighths of all of them; docs/development/experiments.md says what other schedules reach.
struct LevelShare {
  int level, first_eighth, end_eighth;
};
using Schedule = std::array<LevelShare, 3>;
constexpr Schedule kStandardSchedule = {{{2, 0, 6}, {1, 4, 8}, {0, 4, 8}}};
constexpr Schedule kFastSchedule = {{{2, 0, 5}, {1, 4, 7}, {0, 7, 8}}};

// So many times as many iterations; the coarsest level's stay the first ones, the others' the last ones.
LevelShare Scaled(LevelShare share, const Rules& rules) {
  const int count = std::min(8, rules.Count(Rule::kCoarseToFine, share.end_eighth - share.first_eighth));
  if (share.first_eighth == 0) {
    share.end_eighth = count;
  } else {
    share.first_eighth = share.end_eighth - std::min(count, share.end_eighth);
  }
  return share;
}

int LargestLevel(const Pinhole& size, const Rules& rules) {
  return NumLevels(size, rules.Count(Rule::kCoarseToFine, kMinLevelSide), kMaxPyramidLevels) - 1;
}

}  // namespace

std::vector<EstimationPart> EstimationParts(const EstimationInput& input, const StereoOptions& options) {
  const int end = options.num_iterations;
  const int largest_level = LargestLevel(input.reference.view->camera.pinhole, options.method.rules);
  if (options.method.FormulasOf(Rule::kCoarseToFine) == Formulas::kPaper || largest_level == 0) return {{0, 0, end}};
  std::vector<EstimationPart> parts;
  for (const LevelShare& share : options.quality == Quality::kFast ? kFastSchedule : kStandardSchedule) {
    if (share.level > largest_level) continue;
    // Rounded apart, so that each part has an iteration.
    const LevelShare scaled = Scaled(share, options.method.rules);
    parts.push_back({share.level, scaled.first_eighth * end / 8, (scaled.end_eighth * end + 7) / 8});
  }
  parts.front().first_iteration = 0;
  return parts;
}

PartInput::PartInput(const EstimationInput& input, const StereoOptions& options, const EstimationPart& part)
    : part_(part), input_(input), options_(options) {
  if (part.level == 0) return;
  input_.is_reduced = true;
  views_.push_back(ReduceView(*input.reference.view, part.level));
  for (const ViewImage& source : input.sources) views_.push_back(ReduceView(*source.view, part.level));
  input_.reference.view = &views_[0];
  for (std::size_t j = 0; j < input_.sources.size(); ++j) input_.sources[j].view = &views_[j + 1];
  const float scale = 1.0f / static_cast<float>(1 << part.level);
  for (SparseObservation& point : input_.sparse) {
    point.u *= scale;
    point.v *= scale;
  }
  input_.noise *= scale;  // halving takes the mean of four pixels
  options_.num_window_levels = std::min(options.num_window_levels, kMaxPyramidLevels - part.level);
}

EstimationParameters PartInput::Parameters() const {
  EstimationParameters parameters = MakeEstimationParameters(input_, options_);
  parameters.first_iteration = part_.first_iteration;
  parameters.end_iteration = part_.end_iteration;
  return parameters;
}

}  // namespace phi
