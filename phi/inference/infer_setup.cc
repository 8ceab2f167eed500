#include "phi/inference/infer_setup.h"

#include "phi/base/error.h"
#include "phi/inference/image_regions.h"
#include "phi/matching/matching_window.h"

namespace phi {

void CheckInferenceInput(const InferenceInput& input) {
  const auto& image = input.reference.image;
  if (!image || !input.measured || input.reference.view == nullptr ||
      image->width() != input.measured->width() || image->height() != input.measured->height()) {
    throw InputError("plane inference of image " +
                     (input.reference.view != nullptr ? AboutImage(input.reference.view->name) : Message("?")) +
                     ": the depth map's size differs from the image's; run patch_match_stereo again");
  }
  if (input.regions != nullptr &&
      (input.regions->region.width() != image->width() || input.regions->region.height() != image->height())) {
    throw UsageError("plane inference of image " + AboutImage(input.reference.view->name) + ": its regions are of another size");
  }
  for (std::size_t j = 0; j < input.sources.size(); ++j) {
    const auto depths = input.DepthsOf(j);
    const ViewImage& source = input.sources[j];
    if (depths == nullptr || (depths->width() == source.image->width() && depths->height() == source.image->height())) continue;
    throw InputError("plane inference of image " + AboutImage(input.reference.view->name) + ": the depth map's size of source image " +
                     AboutImage(source.view->name) + " differs from that image's; run patch_match_stereo again");
  }
}

InferenceParameters MakeInferenceParameters(const InferenceInput& input, const StereoOptions& stereo, const Method& method) {
  return {.reference = MakeRayModel(input.reference.view->camera.pinhole),
          .window = MakeMatchingWindow(stereo),
          .num_views = static_cast<int>(input.NumMatched()),
          .method = method};
}

}  // namespace phi
