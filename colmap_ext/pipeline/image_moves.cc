#include "colmap_ext/pipeline/image_moves.h"

#include <algorithm>
#include <utility>

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
  const auto worst =
      std::max_element(corrections.of_view.begin(), corrections.of_view.end(),
                       [](const auto& a, const auto& b) { return a.LargestOffset() < b.LargestOffset(); });
  return off +
         ", neighbours alike, so the poses were not adjusted to the points: stereo moves the photos to "
         "them, " +
         workspace.views()[worst - corrections.of_view.begin()].name +
         FormatText(" by up to %.1f pixels", worst->LargestOffset()) +
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
