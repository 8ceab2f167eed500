#include "colmap_ext/one_place.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include <Eigen/Geometry>

#include "phi/base/median.h"

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
// A tenth of the cameras, but one at least, may lie so many times farther out than the others reach, and count no farther.
constexpr double kFarOut = 10;

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

Eigen::Vector3d MiddleOf(const std::vector<Eigen::Vector3d>& centers) {
  Eigen::Vector3d middle;
  std::vector<double> values(centers.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::transform(centers.begin(), centers.end(), values.begin(), [axis](const Eigen::Vector3d& c) { return c[axis]; });
    middle[axis] = phi::Median(&values);
  }
  return middle;
}

// With one pose that a program threw out of the scene, all other cameras would stand together.
double ExtentOf(std::vector<Eigen::Vector3d> centers) {
  if (centers.empty()) return 0;
  const Eigen::Vector3d middle = MiddleOf(centers);
  std::sort(centers.begin(), centers.end(), [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return (a - middle).squaredNorm() < (b - middle).squaredNorm();
  });
  const std::size_t num_inner = centers.size() - std::max<std::size_t>(1, centers.size() / 10);
  Eigen::AlignedBox3d box;
  double inner = 0;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    box.extend(centers[i]);
    if (i + 1 == num_inner) inner = box.diagonal().norm();
  }
  const double whole = box.diagonal().norm();
  return inner > 0 ? std::min(whole, kFarOut * inner) : whole;
}

}  // namespace

OnePlace::OnePlace(const Workspace& workspace) : reach_(NearDepths(workspace)) {
  for (const phi::SceneView& view : workspace.views()) centers_.push_back(view.camera.pose.Center());
  const double rounding = kRounding * ExtentOf(centers_);
  for (double& reach : reach_) reach = std::max(kLeastTangent * reach, rounding);
}

bool OnePlace::StandTogether(int image, int other) const {
  const auto i = static_cast<std::size_t>(image), j = static_cast<std::size_t>(other);
  return (centers_[i] - centers_[j]).norm() <= reach_[i];
}

}  // namespace colmap_ext
