// Where a photo shows its points beside where its camera sees them: poses that were given and not adjusted to the points, a rest
// of distortion, a rolling shutter. Matching looks along the cameras' rays, so a mismatch of half a pixel costs it dearly; photos
// that are moved to their points lose little (docs/development/notes/photographs.md).
#pragma once

#include <vector>

#include "phi/geometry/image_correction.h"
#include "phi/options.h"
#include "phi/scene_view.h"
#include "phi/sparse_scene.h"

namespace phi {

struct ImageCorrections {
  // Root mean square over images and pixels of what the points show at once, pixels of the working images.
  double mean_offset = 0;
  // By view; empty where matching does not need them, and where they would mend nothing.
  std::vector<ImageCorrection> of_view;
  // The points lie so far off that they belong to other cameras than these.
  bool points_are_others = false;
};

// views: poses and working sizes; parallel to the scene's.
ImageCorrections FindImageCorrections(const std::vector<SceneView>& views, const SparseScene& scene,
                                      const Method& method);

}  // namespace phi
