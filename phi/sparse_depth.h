// What the sparse points tell of a view's depths (paper section B): which of them may initialise depth, and the robust depth
// range of the view.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/base/rules.h"
#include "phi/matching/depth_ranges.h"
#include "phi/scene_view.h"
#include "phi/sparse_scene.h"

namespace phi {

// What an estimation needs of the sparse points (see EstimationInput).
struct SparseDepth {
  std::vector<SparseObservation> points;  // reliable points, in pixels of the working resolution
  DepthRange range;                       // robust range of the view, never unknown
};

// Safe to call from several threads at once. `views` and `scene` must outlive it.
class SparseDepthSource {
 public:
  SparseDepthSource(const std::vector<SceneView>& views, const SparseScene& scene, const Rules& rules = {});
  SparseDepth ForView(int view) const;

  // floor(v - 1) of the paper, v the scene's mean track length: a reliable point is seen by at least so many
  // views.
  int min_track_length() const { return min_track_length_; }

 private:
  std::vector<SparseObservation> PointsOf(int view, bool reliable_only) const;

  const std::vector<SceneView>& views_;
  const SparseScene& scene_;
  float scale_;
  VisiblePoints visible_points_;
  std::vector<std::uint8_t> reliable_;  // by point
  int min_track_length_ = 0;
};

// For a view whose own points do not tell: from the scene's points that lie in the view's frustum, else from
// the distances to the neighbouring cameras. scale: of the share left out and of the factor.
DepthRange DepthRangeWithoutOwnPoints(const std::vector<SceneView>& views, const SparseScene& scene, int view,
                                      float scale = 1);

}  // namespace phi
