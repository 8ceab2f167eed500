#include "phi/sparse_scene.h"

namespace phi {
namespace {

// Calls visit(view, point) once for each view of each track; a track may name a view twice.
template <typename Visit>
void ForEachVisiblePoint(const SparseScene& scene, const Visit& visit) {
  std::vector<std::size_t> last_point(scene.num_views(), scene.num_points());
  for (std::size_t point = 0; point < scene.num_points(); ++point) {
    for (const PointObservation& observation : scene.track(point)) {
      if (last_point[observation.view] == point) continue;
      last_point[observation.view] = point;
      visit(observation.view, point);
    }
  }
}

}  // namespace

VisiblePoints::VisiblePoints(const SparseScene& scene) : first_(scene.num_views() + 1, 0) {
  ForEachVisiblePoint(scene, [&](int view, std::size_t) { ++first_[view + 1]; });
  for (int view = 0; view < scene.num_views(); ++view) first_[view + 1] += first_[view];
  points_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  ForEachVisiblePoint(
      scene, [&](int view, std::size_t point) { points_[next[view]++] = static_cast<std::uint32_t>(point); });
}

}  // namespace phi
