// Options of the fusion of depth maps into a point cloud (paper section F), with units and defaults.
#pragma once

#include <string>

#include "phi/options.h"

namespace phi {

struct FusionOptions {
  Method method = {};         // robust: image_fusion.h, paper: paper_fusion.h
  int min_num_views = 2;      // images that must agree on a point, its own included
  int max_num_views = 10000;  // most measurements merged into one point
  // Pixels of the neighbour: of the whole difference in depth. COLMAP's 2 is of the pixel that its depth is read from,
  // which in a direct comparison is always nearer.
  double max_reproj_error = 8;
  double max_depth_error = 0.01;          // difference over depth
  double max_normal_error = 8;            // degrees
  double max_normal_error_in_holes = 60;  // degrees: the same in holes of the cloud (cloud_holes.h), if larger
  // Sum over the other images of their agreement, each in [0, 1]. Of measured pixels those with little support are as
  // often right as others with as many images.
  double min_support = 0;
  // The same for a pixel whose depth was inferred, if larger. Below 1 a single image in close agreement is enough.
  double min_support_inferred = 0.5;
  double max_conflicts = 0.5;  // images that see through the point, per image that supports it
  double min_confidence = 0;   // probability that a point is right (point_confidence.h): those below it are left out
  bool keeps_terms = false;    // no option of a command: blocks hold what confidences were found from, for those who fit the model

  OptionList List();
  std::string Check() const;
};

}  // namespace phi
