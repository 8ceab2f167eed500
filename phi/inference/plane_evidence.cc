#include "phi/inference/plane_evidence.h"

#include <cstddef>
#include <utility>

#include "phi/inference/scene_planes.h"
#include "phi/inference/view_choice.h"

namespace phi {
namespace {

// Of an inlier, relative inverse depth: the greater of a share and of standard deviations of what matching can tell.
constexpr float kTolerance = 0.003f, kToleranceDeviations = 3;

// Of the reference view, as the sources that it was matched with tell it.
DepthPrecision PrecisionOf(const InferenceInput& input) {
  std::vector<const Camera*> sources;
  for (std::size_t j = 0; j < input.NumMatched(); ++j) sources.push_back(&input.sources[j].view->camera);
  return {input.reference.view->camera, sources};
}

std::vector<SourceRegions> RegionsOfSources(const InferenceInput& input, const Rules& rules) {
  std::vector<SourceRegions> sources;
  if (!rules.IsOn(Rule::kSourceRegions)) return sources;
  for (std::size_t j = 0; j < input.source_regions.size(); ++j) {
    if (input.source_regions[j] == nullptr) continue;
    sources.emplace_back(input.source_regions[j], input.sources[j].view->camera, input.reference.view->camera,
                         j < input.source_choices.size() ? input.source_choices[j] : nullptr);
  }
  return sources;
}

}  // namespace

AnchorTolerance RegionTolerance(const DepthPrecision& precision, const Rules& rules) {
  const float scale = rules.Scale(Rule::kRegionPlanes);
  return {scale * kTolerance, scale * kToleranceDeviations, precision};
}

PlaneEvidence GatherPlaneEvidence(const InferenceInput& input, const Rules& rules, std::vector<RelativeExposure>* exposures) {
  PlaneEvidence evidence;
  std::vector<RelativeExposure> found;
  evidence.pooled = PoolAnchors(input, rules, &found);
  evidence.precision = PrecisionOf(input);
  evidence.states = input.measured->states.view();
  evidence.views.emplace(input, found);
  evidence.sources = RegionsOfSources(input, rules);
  const std::vector<CarriedPlane> scene = FindScenePlanes(input, RegionTolerance(evidence.precision, rules), rules);
  evidence.scene.assign(scene.begin(), scene.end());
  if (rules.IsOn(Rule::kRightAngles)) evidence.directions = FindDirections(scene, input.reference.view->camera.pinhole);
  if (exposures != nullptr) *exposures = std::move(found);
  return evidence;
}

PlaneEvidence EvidenceForChoosingAgain(const InferenceInput& input, const ViewChoice& choice, const Rules& rules) {
  PlaneEvidence evidence;
  evidence.directions = choice.directions;
  evidence.views.emplace(input, choice.exposures);
  evidence.sources = RegionsOfSources(input, rules);
  evidence.precision = PrecisionOf(input);
  return evidence;
}

}  // namespace phi
