// Colour pictures of depth, normal, cost and confidence maps. Pixels without a value are black.
#pragma once

#include "colmap_ext/image_file.h"
#include "phi/base/array2d.h"
#include "phi/base/vec.h"

namespace colmap_ext {

struct ValueRange {
  float low = 0, high = 1;
};

// From the 2nd to the 98th percentile of the positive finite values, which outliers do not stretch. [0, 1] where there are none.
ValueRange RobustRange(const phi::Array2D<float>& values);

// Near is warm, far is cold. Values outside the range take its ends' colours; depth <= 0 is black.
ColorImage ColorizeDepth(const phi::Array2D<float>& depth, const ValueRange& range);

// Camera frame: red = right, green = up, blue = towards the camera, each from -1 to 1. The zero vector is black.
ColorImage ColorizeNormals(const phi::Array2D<phi::Vec3f>& normals);

// Low (good) is dark, high is bright; 2 is the cost of a pixel without a valid match. Not finite is black.
ColorImage ColorizeCost(const phi::Array2D<float>& cost, const ValueRange& range = {0, 2});

// Sure is bright; 0 is black.
ColorImage ColorizeConfidence(const phi::Array2D<float>& confidence);

// Two pictures of one height beside each other, with a white gap.
ColorImage SideBySide(const ColorImage& left, const ColorImage& right);

}  // namespace colmap_ext
