// How a cloud's file states positions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "colmap_ext/workspace.h"

namespace colmap_ext {

// Each position keeps at least a tenth of the distance between neighbouring points; where nothing tells that distance, a tenth of a
// millimetre if the world's unit is the metre.
struct CloudCoordinates {
  std::array<double, 3> offset{0, 0, 0};  // world units, whole
  bool in_doubles = false;                // of PLY: even from the offset single precision is too coarse
  double las_scale = 0.001;               // world units: a power of ten, a millimetre at most and a hundredth of the distance
};

// spacing: between neighbouring points, world units; 0: not known. middle: where the offset is, if one is needed. largest: the largest
// coordinate from an offset, world units.
CloudCoordinates ChooseCoordinates(double spacing, const Eigen::Vector3d& middle,
                                   const std::function<double(const Eigen::Vector3d& offset)>& largest);

// From its cameras and sparse points, before there is a cloud.
CloudCoordinates ChooseCoordinates(const Workspace& workspace);

// The largest of these coordinates but for a hundredth of them, which may be of outliers; 0: there are none.
double LargestWithoutOutliers(std::vector<double> coordinates);

}  // namespace colmap_ext
