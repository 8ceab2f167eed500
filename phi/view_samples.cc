#include "phi/view_samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include <Eigen/Geometry>

namespace phi {
namespace {

// The cameras' own evidence looks at so many candidates around the reference; the far ones of 10,000 cannot matter.
constexpr int kMostNearbyCameras = 128;
// A point that two views see from directions farther apart than this says little: no window matches itself there.
constexpr double kWidestAngle = 60 * std::numbers::pi / 180;

double FocalLength(const Pinhole& pinhole) { return std::sqrt(pinhole.fx * pinhole.fy); }

}  // namespace

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

ViewSampler::ViewSampler(const std::vector<SceneView>& views, const std::vector<Eigen::Vector3d>& centers,
                         const ViewSelectionOptions& options, int reference)
    : views_(views),
      centers_(centers),
      options_(options),
      scale_(options.method.rules.Scale(Rule::kWeakViews)),
      reference_(reference) {}

// False when the point is behind one of the cameras, or when `inside` asks for it and the source's image misses it.
bool ViewSampler::Measure(int source_view, const Eigen::Vector3d& world, bool inside,
                          ViewSample* sample) const {
  const Camera &reference = views_[reference_].camera, &source = views_[source_view].camera;
  // Relative to the centres: world coordinates may be far from the origin.
  const Eigen::Vector3d from_reference = world - centers_[reference_];
  const Eigen::Vector3d from_source = world - centers_[source_view];
  const Eigen::Vector3d in_reference = reference.pose.rotation * from_reference;
  const Eigen::Vector3d in_source = source.pose.rotation * from_source;
  if (in_reference.z() <= 0 || in_source.z() <= 0) return false;
  const Eigen::Vector2d pixel = source.pinhole.Project(in_source);
  if (inside && !source.pinhole.Contains(pixel)) return false;
  // Eq. 1 moves the point along the reference's ray: (1 + eps) X - eps C.
  const Eigen::Vector3d moved =
      in_source + options_.displacement_epsilon * (source.pose.rotation * from_reference);
  if (moved.z() <= 0) return false;
  sample->angle = static_cast<float>(AngleBetween(from_reference, from_source));
  if (options_.method.formulas == Formulas::kRobust && sample->angle > scale_ * kWidestAngle) return false;
  sample->view = source_view;
  sample->displacement = static_cast<float>((source.pinhole.Project(moved) - pixel).norm());
  sample->log_scale = static_cast<float>(std::log(FocalLength(source.pinhole) / in_source.z() *
                                                  in_reference.z() / FocalLength(reference.pinhole)));
  sample->to_source = -from_source.normalized().cast<float>();
  const Eigen::Vector2d seen = reference.pinhole.Project(in_reference);
  sample->u = static_cast<float>(seen.x() / reference.pinhole.width);
  sample->v = static_cast<float>(seen.y() / reference.pinhole.height);
  return true;
}

std::vector<ViewSample> ViewSampler::FromPoints(const SparseScene& scene,
                                                std::span<const std::uint32_t> points) const {
  std::vector<ViewSample> samples;
  std::vector<std::uint32_t> last_slot(scene.num_views(), ~0u);
  for (std::uint32_t slot = 0; slot < points.size(); ++slot) {
    for (const PointObservation& observation : scene.track(points[slot])) {
      if (observation.view == reference_ || last_slot[observation.view] == slot) continue;
      last_slot[observation.view] = slot;
      ViewSample sample{.point = slot};
      if (Measure(observation.view, scene.point(points[slot]), /*inside=*/false, &sample))
        samples.push_back(sample);
    }
  }
  return samples;
}

std::vector<Eigen::Vector3d> ViewSampler::FrustumPoints(double depth_min, double depth_max) const {
  constexpr Rule kRule = Rule::kWeakViews;
  const int num_columns = options_.method.rules.Count(kRule, 8), num_rows = options_.method.rules.Count(kRule, 6),
            num_depths = options_.method.rules.Count(kRule, 6);
  const Camera& camera = views_[reference_].camera;
  const Pinhole& k = camera.pinhole;
  std::vector<Eigen::Vector3d> points;
  for (int d = 0; d < num_depths; ++d) {
    const double depth = depth_min * std::pow(depth_max / depth_min, (d + 0.5) / num_depths);
    for (int row = 0; row < num_rows; ++row) {
      for (int column = 0; column < num_columns; ++column) {
        const double u = (column + 0.5) / num_columns * k.width, v = (row + 0.5) / num_rows * k.height;
        const Eigen::Vector3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1);
        points.push_back(centers_[reference_] + camera.pose.rotation.transpose() * (depth * ray));
      }
    }
  }
  return points;
}

// The nearest ones, by image id where distances are equal.
std::vector<int> ViewSampler::NearbyCameras() const {
  std::vector<std::tuple<double, std::uint32_t, int>> order;
  for (int view = 0; view < static_cast<int>(views_.size()); ++view) {
    if (view == reference_) continue;
    order.emplace_back((centers_[view] - centers_[reference_]).squaredNorm(), views_[view].image_id, view);
  }
  const std::size_t count =
      std::min<std::size_t>(order.size(), options_.method.rules.Count(Rule::kWeakViews, kMostNearbyCameras));
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end());
  std::vector<int> nearby;
  for (std::size_t i = 0; i < count; ++i) nearby.push_back(std::get<2>(order[i]));
  return nearby;
}

std::vector<ViewSample> ViewSampler::FromFrustum(double depth_min, double depth_max) const {
  const std::vector<Eigen::Vector3d> points = FrustumPoints(depth_min, depth_max);
  const std::vector<int> candidates = NearbyCameras();
  std::vector<ViewSample> samples;
  for (std::uint32_t point = 0; point < points.size(); ++point) {
    for (const int view : candidates) {
      ViewSample sample{.point = point};
      if (Measure(view, points[point], /*inside=*/true, &sample)) samples.push_back(sample);
    }
  }
  return samples;
}

}  // namespace phi
