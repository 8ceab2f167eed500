#include "colmap_ext/fusion/empty_box.h"

#include <string>
#include <vector>

#include "colmap_ext/format_text.h"
#include "colmap_ext/fusion/cloud_coordinates.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

using phi::PixelOutcome;

std::vector<Eigen::Vector3d> SparsePlaces(const Workspace& workspace) {
  std::vector<Eigen::Vector3d> places;
  for (const SparsePoint& point : workspace.model().points) places.push_back(point.xyz);
  return places;
}

std::vector<Eigen::Vector3d> CameraPlaces(const Workspace& workspace) {
  std::vector<Eigen::Vector3d> places;
  for (const phi::SceneView& view : workspace.views()) places.push_back(view.camera.pose.Center());
  return places;
}

// But for outliers.
phi::BoundingBox BoxAround(const std::vector<Eigen::Vector3d>& places) {
  phi::BoundingBox box;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> least, most;
    for (const Eigen::Vector3d& place : places) {
      least.push_back(-place[axis]);
      most.push_back(place[axis]);
    }
    box.min[axis] = -LargestWithoutOutliers(std::move(least));
    box.max[axis] = LargestWithoutOutliers(std::move(most));
  }
  return box;
}

std::string CornersText(const phi::BoundingBox& box) {
  return FormatText("x %.6g to %.6g, y %.6g to %.6g, z %.6g to %.6g", box.min[0], box.max[0], box.min[1], box.max[1], box.min[2],
                    box.max[2]);
}

}  // namespace

void RequirePointsInBox(const SceneFusionReport& report, const Workspace& workspace, const SceneFusionOptions& options,
                        const std::filesystem::path& path) {
  if (!options.box || report.num_points > 0 || report.outcomes[PixelOutcome::kOutsideBox] == 0) return;
  const bool has_points = !workspace.model().points.empty();
  const phi::BoundingBox scene = BoxAround(has_points ? SparsePlaces(workspace) : CameraPlaces(workspace));
  throw phi::InputError(phi::AboutStage("fusion") + ": " + phi::AboutFile(path) + ": this box, " + CornersText(*options.box) +
                        ", holds none of the points that were found; " + (has_points ? "the sparse points" : "the cameras") +
                        " lie at " + CornersText(scene) +
                        ". Give its corners in the sparse model's coordinates, without the offset that a cloud's header may name");
}

}  // namespace colmap_ext
