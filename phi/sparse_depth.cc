#include "phi/sparse_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace phi {
namespace {

// Paper section B: points with a larger mean reprojection error may be wrong.
constexpr double kMaxReprojectionError = 2;  // pixels of the sparse model's images
// Fewer points than these do not tell a view's range of depth.
constexpr std::size_t kFewestPointsForRange = 10;
// The sparse points sample the scene's depths; surfaces lie in front of the nearest and behind the farthest
// of them.
constexpr double kOutlierShare = 0.01;
constexpr double kRangeMargin = 2;
// Enough of the scene's points to find out what lies in a frustum.
constexpr std::size_t kMostPointsForFrustum = 100000;

Eigen::Vector3d InCamera(const Camera& camera, const Eigen::Vector3d& center, const Eigen::Vector3d& world) {
  return camera.pose.rotation * (world - center);
}

// Mean over the track, from the cameras: the error that a model stores may be in the pixels of the original
// pictures, before the undistorter reduced them. Infinite when the point is behind a camera that claims to
// see it.
double ReprojectionError(const std::vector<SceneView>& views, const std::vector<Eigen::Vector3d>& centers,
                         const SparseScene& scene, std::size_t point) {
  double sum = 0;
  for (const PointObservation& observation : scene.track(point)) {
    const Eigen::Vector3d camera =
        InCamera(views[observation.view].camera, centers[observation.view], scene.point(point));
    if (camera.z() <= 0) return std::numeric_limits<double>::infinity();
    const Eigen::Vector2d pixel = scene.model_pinhole(observation.view).Project(camera);
    sum += (pixel - Eigen::Vector2d(observation.u, observation.v)).norm();
  }
  return sum / static_cast<double>(scene.track(point).size());
}

// Unknown when the depths are too few.
DepthRange RobustRange(std::vector<float> depths, float scale) {
  if (depths.size() < kFewestPointsForRange) return {};
  std::sort(depths.begin(), depths.end());
  const auto last = static_cast<double>(depths.size() - 1);
  const float near = depths[static_cast<std::size_t>(std::lround(scale * kOutlierShare * last))];
  const float far = depths[static_cast<std::size_t>(std::lround((1 - scale * kOutlierShare) * last))];
  return {static_cast<float>(near / (scale * kRangeMargin)),
          static_cast<float>(far * (scale * kRangeMargin))};
}

std::vector<float> DepthsOf(const std::vector<SparseObservation>& points) {
  std::vector<float> depths;
  depths.reserve(points.size());
  for (const SparseObservation& point : points) depths.push_back(point.depth);
  return depths;
}

// Multi-view stereo sees a surface from cameras that stand apart by between 1/50 of its distance and about
// twice that distance; the four nearest cameras tell how far apart they stand. Those at the view's own place, but for rounding, do
// not.
DepthRange RangeFromBaselines(const std::vector<SceneView>& views, int view) {
  const Eigen::Vector3d center = views[view].camera.pose.Center();
  constexpr double kRounding = 1e-6;  // of the farthest camera's distance
  std::vector<double> baselines;
  for (const SceneView& other : views) baselines.push_back((other.camera.pose.Center() - center).norm());
  const double farthest = *std::max_element(baselines.begin(), baselines.end());
  std::erase_if(baselines, [&](double baseline) { return baseline <= kRounding * farthest; });
  if (baselines.empty()) return {0.1f, 100.0f};  // one camera: nothing can be triangulated anyway
  std::sort(baselines.begin(), baselines.end());
  baselines.resize(std::min<std::size_t>(baselines.size(), 4));
  const double typical = baselines[baselines.size() / 2];
  return {static_cast<float>(0.5 * typical), static_cast<float>(50 * typical)};
}

}  // namespace

SparseDepthSource::SparseDepthSource(const std::vector<SceneView>& views, const SparseScene& scene,
                                     const Rules& rules)
    : views_(views),
      scene_(scene),
      scale_(rules.Scale(Rule::kDepthBounds)),
      visible_points_(scene),
      reliable_(scene.num_points(), 0) {
  if (scene.num_points() == 0) return;
  const double mean_track =
      static_cast<double>(scene.num_observations()) / static_cast<double>(scene.num_points());
  min_track_length_ = static_cast<int>(std::floor(mean_track - 1));
  std::vector<Eigen::Vector3d> centers;
  for (const SceneView& view : views) centers.push_back(view.camera.pose.Center());
  for (std::size_t point = 0; point < scene.num_points(); ++point) {
    reliable_[point] = static_cast<int>(scene.track(point).size()) >= min_track_length_ &&
                       ReprojectionError(views, centers, scene, point) < kMaxReprojectionError;
  }
}

std::vector<SparseObservation> SparseDepthSource::PointsOf(int view, bool reliable_only) const {
  const Camera& camera = views_[view].camera;
  const Eigen::Vector3d center = camera.pose.Center();
  std::vector<SparseObservation> points;
  for (const std::uint32_t point : visible_points_[view]) {
    if (reliable_only && !reliable_[point]) continue;
    const Eigen::Vector3d in_camera = InCamera(camera, center, scene_.point(point));
    if (in_camera.z() <= 0) continue;
    const Eigen::Vector2d pixel = camera.pinhole.Project(in_camera);
    points.push_back(
        {static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), static_cast<float>(in_camera.z())});
  }
  return points;
}

SparseDepth SparseDepthSource::ForView(int view) const {
  SparseDepth sparse;
  sparse.points = PointsOf(view, /*reliable_only=*/true);
  sparse.range = RobustRange(DepthsOf(sparse.points), scale_);
  if (sparse.range.max <= 0)
    sparse.range = RobustRange(DepthsOf(PointsOf(view, /*reliable_only=*/false)), scale_);
  if (sparse.range.max <= 0) sparse.range = DepthRangeWithoutOwnPoints(views_, scene_, view, scale_);
  return sparse;
}

DepthRange DepthRangeWithoutOwnPoints(const std::vector<SceneView>& views, const SparseScene& scene, int view,
                                      float scale) {
  const Camera& camera = views[view].camera;
  const Eigen::Vector3d center = camera.pose.Center();
  const std::size_t stride = scene.num_points() / kMostPointsForFrustum + 1;
  std::vector<float> depths;
  for (std::size_t point = 0; point < scene.num_points(); point += stride) {
    const Eigen::Vector3d in_camera = InCamera(camera, center, scene.point(point));
    if (in_camera.z() <= 0) continue;
    if (camera.pinhole.Contains(camera.pinhole.Project(in_camera))) depths.push_back(static_cast<float>(in_camera.z()));
  }
  const DepthRange range = RobustRange(std::move(depths), scale);
  return range.max > 0 ? range : RangeFromBaselines(views, view);
}

}  // namespace phi
