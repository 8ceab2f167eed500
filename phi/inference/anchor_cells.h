// Anchors gathered in cells of the image and of depth, so that a spot counts once however many pixels measured it.
#pragma once

#include <algorithm>
#include <vector>

#include "phi/geometry/depth_precision.h"
#include "phi/inference/image_plane.h"

namespace phi {

// How far from a plane an anchor on it may lie.
struct AnchorTolerance {
  // Relative inverse depth: the greater of a share and of standard deviations of what matching can tell.
  float share, deviations;
  DepthPrecision precision;

  // Of inverse depth w at array indices (x, y).
  float At(float x, float y, float w) const;
  // Of inverse depth w, of which matching can tell `deviation`, relative.
  float Of(float deviation, float w) const { return std::max(share, deviations * deviation) * w; }
  // Whether `off` is at most that; mostly the share alone says so.
  bool Contains(float x, float y, float w, double off) const { return off <= share * w || off <= At(x, y, w); }
};

// In the reference image and camera: array indices, inverse depth.
struct AnchorPoint {
  float x, y, w;
  bool is_measured = true;  // a clue otherwise
  float weight = 1;         // in what its cell says of a plane
};

// The means of a cell's points.
struct AnchorCell {
  float x, y;
  double w, tolerance;
  int column, row;  // of the cells of its image
  bool is_measured = true;  // one of its points is
  float weight = 1;

  // 0: on the plane; below -1 or above 1: off it, behind or before.
  double Off(const ImagePlane& plane) const { return (w - plane.InverseDepth(x, y)) / tolerance; }
};

// Pixels, of a cell's side.
float CellSide(int image_width);

// Cells with at least `min_points` of the points, by column, row and depth. A cell is `side` pixels wide and high and a
// hundredth of its depth deep.
std::vector<AnchorCell> MakeAnchorCells(const std::vector<AnchorPoint>& points, float side, int min_points,
                                        const AnchorTolerance& tolerance);

}  // namespace phi
