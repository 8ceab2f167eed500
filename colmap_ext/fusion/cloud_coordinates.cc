#include "colmap_ext/fusion/cloud_coordinates.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>

namespace colmap_ext {
namespace {

// values: not empty.
double Percentile(std::vector<double>* values, double share) {
  const auto place = values->begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values->size() - 1));
  std::nth_element(values->begin(), place, values->end());
  return *place;
}

// Between neighbouring points of the cloud: what a pixel spans at the sparse points. 0: there are none.
double PointSpacing(const Workspace& workspace) {
  std::unordered_map<std::uint32_t, const phi::Camera*> cameras;
  for (const phi::SceneView& view : workspace.views()) cameras[view.image_id] = &view.camera;
  std::vector<double> spacings;
  for (const SparsePoint& point : workspace.model().points) {
    if (point.track.empty()) continue;
    const auto camera = cameras.find(point.track.front().image_id);
    if (camera == cameras.end() || !(camera->second->pinhole.fx > 0)) continue;
    spacings.push_back((point.xyz - camera->second->pose.Center()).norm() / camera->second->pinhole.fx);
  }
  return spacings.empty() ? 0 : Percentile(&spacings, 0.5);
}

// Of the cameras and of nearly all points.
double LargestCoordinate(const Workspace& workspace, const Eigen::Vector3d& offset) {
  double largest = 0;
  for (const phi::SceneView& view : workspace.views())
    largest = std::max(largest, (view.camera.pose.Center() - offset).cwiseAbs().maxCoeff());
  std::vector<double> of_points;
  for (const SparsePoint& point : workspace.model().points)
    of_points.push_back((point.xyz - offset).cwiseAbs().maxCoeff());
  return std::max(largest, LargestWithoutOutliers(std::move(of_points)));
}

Eigen::Vector3d MeanCenter(const Workspace& workspace) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const phi::SceneView& view : workspace.views())
    mean += view.camera.pose.Center() / static_cast<double>(workspace.views().size());
  return mean;
}

double Whole(double coordinate) { return std::round(coordinate) + 0.0; }  // no -0

}  // namespace

double LargestWithoutOutliers(std::vector<double> coordinates) {
  return coordinates.empty() ? 0 : Percentile(&coordinates, 0.99);
}

CloudCoordinates ChooseCoordinates(double spacing, const Eigen::Vector3d& middle,
                                   const std::function<double(const Eigen::Vector3d& offset)>& largest) {
  constexpr double kSinglePrecision = 1.0 / (1 << 24), kShareOfSpacing = 0.1;
  constexpr double kMillimetre = 0.001, kUnitsPerSpacing = 100;
  // Where no point tells the spacing: at so many world units a step of single precision nears a tenth of a millimetre.
  constexpr double kFarWithoutSpacing = 1000;
  CloudCoordinates coordinates;
  const double coarsest = spacing > 0 ? kShareOfSpacing * spacing : kFarWithoutSpacing * kSinglePrecision;
  if (largest(Eigen::Vector3d::Zero()) * kSinglePrecision > coarsest) {
    coordinates.offset = {Whole(middle.x()), Whole(middle.y()), Whole(middle.z())};
    coordinates.in_doubles = largest(Eigen::Vector3d(coordinates.offset.data())) * kSinglePrecision > coarsest;
  }
  if (spacing > 0) {
    coordinates.las_scale =
        std::min(kMillimetre, std::pow(10.0, std::floor(std::log10(spacing / kUnitsPerSpacing))));
  }
  return coordinates;
}

CloudCoordinates ChooseCoordinates(const Workspace& workspace) {
  return ChooseCoordinates(PointSpacing(workspace), MeanCenter(workspace),
                           [&](const Eigen::Vector3d& offset) { return LargestCoordinate(workspace, offset); });
}

}  // namespace colmap_ext
