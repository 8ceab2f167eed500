#include "colmap_ext/one_place.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include <Eigen/Geometry>

namespace colmap_ext {
namespace {

// As where source views are selected (view_selection.cc): cameras that triangulate by less triangulate nothing.
const double kLeastTangent = std::tan(0.1 * std::numbers::pi / 180);
// Share of the nearest points that may be wrong.
constexpr double kOutliers = 0.01;
// Fewer do not tell what is near.
constexpr std::size_t kFewestPoints = 10;
// Of the cameras' extent: poses in files are rounded, and so are the centres that follow from them.
constexpr double kRounding = 1e-6;

// The near depth among the points of each view; 0: not known.
std::vector<double> NearDepths(const Workspace& workspace) {
  std::unordered_map<std::uint32_t, std::size_t> view_of_id;
  const auto& views = workspace.views();
  for (std::size_t i = 0; i < views.size(); ++i) view_of_id.emplace(views[i].image_id, i);
  std::vector<std::vector<float>> depths(views.size());
  for (const SparsePoint& point : workspace.model().points) {
    for (const TrackElement& element : point.track) {
      const auto found = view_of_id.find(element.image_id);
      if (found == view_of_id.end()) continue;
      const phi::Pose& pose = views[found->second].camera.pose;
      const double depth = pose.rotation.row(2).dot(point.xyz) + pose.translation.z();
      if (depth > 0) depths[found->second].push_back(static_cast<float>(depth));
    }
  }
  std::vector<double> near(views.size(), 0);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (depths[i].size() < kFewestPoints) continue;
    const auto rank = static_cast<std::ptrdiff_t>(kOutliers * static_cast<double>(depths[i].size()));
    const auto place = depths[i].begin() + rank;
    std::nth_element(depths[i].begin(), place, depths[i].end());
    near[i] = *place;
  }
  return near;
}

}  // namespace

OnePlace::OnePlace(const Workspace& workspace) : reach_(NearDepths(workspace)) {
  Eigen::AlignedBox3d extent;
  for (const phi::SceneView& view : workspace.views()) {
    centers_.push_back(view.camera.pose.Center());
    extent.extend(centers_.back());
  }
  const double rounding = centers_.empty() ? 0 : kRounding * extent.diagonal().norm();
  for (double& reach : reach_) reach = std::max(kLeastTangent * reach, rounding);
}

bool OnePlace::StandTogether(int image, int other) const {
  const auto i = static_cast<std::size_t>(image), j = static_cast<std::size_t>(other);
  return (centers_[i] - centers_[j]).norm() <= reach_[i];
}

}  // namespace colmap_ext
