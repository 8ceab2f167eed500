// Source views for each reference view (paper section A, Eq. 1 to 3).
//
// A source view must see the same surface (shared sparse points), from far enough away that depth shows and from near
// enough that the surface looks the same. The paper ranks views one by one; the robust rule chooses the set that shows
// the whole image best (view_coverage.h).
#pragma once

#include <vector>

#include "phi/options.h"
#include "phi/scene_view.h"
#include "phi/sparse_scene.h"

namespace phi {

struct SourceView {
  int view = 0;                    // index into the scene's views
  int num_shared_points = 0;       // N_A; 0: selected by the cameras alone
  double triangulation_angle = 0;  // degrees, median over the shared points
  double displacement = 0;         // tau of Eq. 2, pixels of the source view at its working resolution
  double score = 0;                // zeta of Eq. 3, smaller is better; the paper's rule alone ranks by it
};

// Selections do not depend on the order of the views: ties go to the smaller image id. Safe to call from
// several threads at once. `views` and `scene` must outlive the selector.
class ViewSelector {
 public:
  ViewSelector(const std::vector<SceneView>& views, const SparseScene& scene,
               const ViewSelectionOptions& options);

  // At most max_num_views views, best first. Empty only when no other camera looks at what the reference
  // sees; formulas paper: when none shares sparse points with it from far enough away. Throws Cancelled.
  std::vector<SourceView> Select(int reference, int max_num_views) const;

 private:
  const std::vector<SceneView>& views_;
  const SparseScene& scene_;
  ViewSelectionOptions options_;
  VisiblePoints visible_points_;
  std::vector<Eigen::Vector3d> centers_;  // world
  std::vector<std::uint32_t> image_ids_;
};

// Select(reference, options.NumSelectedViews()) for every view, in parallel.
std::vector<std::vector<SourceView>> SelectSourceViews(const std::vector<SceneView>& views,
                                                       const SparseScene& scene,
                                                       const ViewSelectionOptions& options);

}  // namespace phi
