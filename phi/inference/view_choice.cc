#include "phi/inference/view_choice.h"

#include <memory>
#include <utility>

#include "phi/inference/hypotheses.h"
#include "phi/inference/infer_setup.h"
#include "phi/inference/plane_evidence.h"
#include "phi/inference/region_planes.h"

namespace phi {

std::size_t ViewChoice::bytes() const {
  std::size_t bytes = sizeof(*this) + fitted.index.size() * sizeof(fitted.index[0]) + fitted.regions.size() * sizeof(FittedRegion);
  for (const FittedRegion& region : fitted.regions) {
    bytes += region.cells.size() * sizeof(AnchorCell) + region.likeliest.size() * sizeof(PlaneCandidate);
  }
  for (const RelativeExposure& exposure : exposures) bytes += exposure.bytes();
  return bytes;
}

ViewChoice ChooseRegionPlanes(const InferenceInput& input, const Rules& rules) {
  CheckInferenceInput(input);
  const Array2D<float> anchors = AnchorMap(*input.measured, Formulas::kRobust);
  ViewChoice choice;
  PlaneEvidence evidence = GatherPlaneEvidence(input, rules, &choice.exposures);
  choice.fitted = FitRegions(*RegionsOf(input, rules), anchors.view(), input.reference.view->image_id, evidence, rules);
  choice.directions = std::move(evidence.directions);
  return choice;
}

}  // namespace phi
