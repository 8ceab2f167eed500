#include "colmap_ext/pipeline/image_moves.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "colmap_ext/format_text.h"
#include "phi/base/log.h"

namespace colmap_ext {

std::string PoseWarning(const phi::ImageCorrections& corrections, const Workspace& workspace) {
  const std::string off =
      FormatText("the photos show the sparse points %.1f pixels beside where their cameras see them",
                 corrections.mean_offset);
  if (corrections.points_are_others)
    return off + ": are these the points of these cameras? Stereo takes the photos as they are";
  if (corrections.of_view.empty()) return "";
  std::vector<double> largest;  // by view; pixels of the working images, as the mean
  for (std::size_t i = 0; i < corrections.of_view.size(); ++i) {
    const phi::ImageCorrection& correction = corrections.of_view[i];
    largest.push_back(correction.LargestOffset() * workspace.views()[i].camera.pinhole.width / correction.model_width());
  }
  const auto worst = std::max_element(largest.begin(), largest.end());
  return off +
         ", neighbours alike, so the poses were not adjusted to the points: stereo moves the photos to "
         "them, " +
         workspace.views()[worst - largest.begin()].name +
         FormatText(" by up to %.1f pixels", *worst) +
         ". Where poses may change, colmap bundle_adjuster before image_undistorter is better";
}

void MoveImages(const phi::SparseScene& scene, const phi::StereoOptions& options, Workspace* workspace) {
  phi::ImageCorrections corrections =
      phi::FindImageCorrections(workspace->views(), scene, {options.formulas, options.rules});
  if (const std::string warning = PoseWarning(corrections, *workspace); !warning.empty())
    phi::LogWarning(warning);
  workspace->SetCorrections(std::move(corrections.of_view));
}

}  // namespace colmap_ext
