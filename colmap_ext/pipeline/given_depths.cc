#include "colmap_ext/pipeline/given_depths.h"

#include <algorithm>
#include <cstddef>

#include "colmap_ext/format_text.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

// Who cuts off what lies before or behind a thing leaves more than so many of the points.
constexpr double kFewestWithin = 0.02;

// As images see the points.
template <typename Take>
void ForSparseDepths(const phi::SparseScene& scene, const std::vector<phi::SceneView>& views, const Take& take) {
  for (std::size_t point = 0; point < scene.num_points(); ++point) {
    for (const phi::PointObservation& seen : scene.track(point)) {
      const double depth = (views[static_cast<std::size_t>(seen.view)].camera.pose * scene.point(point)).z();
      if (depth > 0) take(depth);
    }
  }
}

}  // namespace

std::string GivenDepthsWarning(const phi::SparseScene& scene, const std::vector<phi::SceneView>& views, double depth_min,
                               double depth_max) {
  if (depth_min < 0) return "";
  std::size_t num_all = 0, num_within = 0;
  ForSparseDepths(scene, views, [&](double depth) {
    ++num_all;
    if (depth >= depth_min && depth <= depth_max) ++num_within;
  });
  if (num_all == 0) return "";
  const double share = static_cast<double>(num_within) / static_cast<double>(num_all);
  if (share > kFewestWithin) return "";
  std::vector<double> depths;  // kept and sorted for the message alone: a large model has tens of millions
  ForSparseDepths(scene, views, [&](double depth) { depths.push_back(depth); });
  std::sort(depths.begin(), depths.end());
  return FormatText("--PatchMatchStereo.depth_min and depth_max, %.6g to %.6g, hold %.1f %% of the sparse points; nine in ten lie at "
                    "depths of %.6g to %.6g, in the model's unit: give a range in that unit, or leave it out",
                    depth_min, depth_max, 100 * share, depths[depths.size() / 20], depths[depths.size() - 1 - depths.size() / 20]);
}

void WarnOfGivenDepths(const phi::SparseScene& scene, const std::vector<phi::SceneView>& views, const PipelineOptions& options) {
  const std::string warning = GivenDepthsWarning(scene, views, options.depth_min, options.depth_max);
  if (!warning.empty()) phi::LogWarning(warning);
}

}  // namespace colmap_ext
