#include "colmap_ext/evaluation/truth_coverage.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "colmap_ext/evaluation/truth_maps.h"
#include "colmap_ext/workspace.h"
#include "phi/base/cancellation.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

// Marks the points that fall on a pixel with truth in one image.
void MarkCovered(const std::vector<phi::Vec3f>& points, const Eigen::Vector3d& origin,
                 const phi::Camera& camera, const phi::Array2D<float>& truth,
                 std::vector<std::uint8_t>& covered) {
  const phi::Pinhole& k = camera.pinhole;
  // The truth may have been stored at another size than the camera's.
  const double scale_x = static_cast<double>(truth.width()) / k.width;
  const double scale_y = static_cast<double>(truth.height()) / k.height;
  const Eigen::Vector3d origin_in_camera = camera.pose * origin;
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    if (covered[i]) return;
    const Eigen::Vector3d p =
        camera.pose.rotation * Eigen::Vector3d(points[i].x, points[i].y, points[i].z) + origin_in_camera;
    if (!(p.z() > 0)) return;
    const double x = std::floor((p.x() / p.z() * k.fx + k.cx) * scale_x);
    const double y = std::floor((p.y() / p.z() * k.fy + k.cy) * scale_y);
    if (!(x >= 0 && y >= 0 && x < truth.width() && y < truth.height())) return;
    covered[i] = truth(static_cast<int>(x), static_cast<int>(y)) > 0;
  });
}

}  // namespace

std::vector<bool> CoveredByTruth(const std::vector<phi::Vec3f>& points, const Eigen::Vector3d& origin,
                                 const CoverageOptions& options) {
  WorkspaceOptions workspace_options;
  workspace_options.path = options.workspace;
  const Workspace workspace(workspace_options);
  const auto maps = FindTruthMaps(options.truth_depth_maps);
  std::vector<std::uint8_t> covered(points.size(), 0);
  bool any = false;
  for (const phi::SceneView& view : workspace.views()) {
    phi::ThrowIfCancelled();
    const auto map = maps.find(view.name);
    if (map == maps.end()) continue;
    any = true;
    MarkCovered(points, origin, view.camera, ReadTruthDepth(map->second, options.values_per_unit), covered);
  }
  if (!any) {
    throw phi::InputError("no map in " + options.truth_depth_maps.string() + " has the name of an image of " +
                          options.workspace.string());
  }
  return {covered.begin(), covered.end()};
}

}  // namespace colmap_ext
