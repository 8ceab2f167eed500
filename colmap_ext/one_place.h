// Which cameras stand at one place: duplicates of a photo, brackets of exposure, the faces of a panorama. What one of them sees, the
// other sees from the same side, so that neither confirms the other's depths.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "colmap_ext/workspace.h"

namespace colmap_ext {

class OnePlace {
 public:
  // From the poses and the sparse points. `workspace` must outlive it.
  explicit OnePlace(const Workspace& workspace);

  // Whether even the near surfaces that `image` sees move by less than a tenth of a degree between the two centres, or poses
  // cannot tell the centres apart. Indices into Workspace::views().
  bool StandTogether(int image, int other) const;

 private:
  std::vector<Eigen::Vector3d> centers_;  // world
  std::vector<double> reach_;             // of each image: centres so near stand together; world units
};

}  // namespace colmap_ext
