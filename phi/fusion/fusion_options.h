// Options of the fusion of depth maps into a point cloud (paper section F), with units and defaults.
#pragma once

#include <string>

#include "phi/options.h"

namespace phi {

struct FusionOptions {
  Formulas formulas =
      Formulas::kRobust;  // --PhiFusion.formulas; robust: image_fusion.h, paper: paper_fusion.h
  // --StereoFusion.min_num_pixels: images that must agree on a point, its own included
  int min_num_views = 2;
  // --StereoFusion.max_num_pixels: most measurements merged into one point
  int max_num_views = 10000;
  // --StereoFusion.max_reproj_error, pixels of the neighbour: of the whole difference in depth. COLMAP's 2 is of the
  // pixel that its depth is read from, which in a direct comparison is always nearer.
  double max_reproj_error = 8;
  // --StereoFusion.max_depth_error, difference over depth
  double max_depth_error = 0.01;
  // --StereoFusion.max_normal_error, degrees
  double max_normal_error = 8;
  // --PhiFusion.max_normal_error_in_holes, degrees: the same in holes of the cloud (cloud_holes.h), if larger
  double max_normal_error_in_holes = 60;
  // --PhiFusion.min_support: sum over the other images of their agreement, each in [0, 1]. Of
  // measured pixels those with little support are as often right as others with as many images.
  double min_support = 0;
  // --PhiFusion.min_support_inferred: the same for a pixel whose depth was inferred, if larger. Below 1 a single image
  // in close agreement is enough.
  double min_support_inferred = 0.5;
  // --PhiFusion.max_conflicts: images that see through the point, per image that supports it
  double max_conflicts = 0.5;
  std::string Check() const;
};

}  // namespace phi
