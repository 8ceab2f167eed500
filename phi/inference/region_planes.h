// Plane hypotheses from larger anchors than a scanline: an evenly coloured region of the image is likely to be one
// surface, or a few, and its measured rim carries planes that lines through six pixels only guess.
//
// Regions are connected pixels whose smoothed brightness changes slowly. Each gets up to two planes in inverse depth
// by RANSAC over its measured pixels and those of other views that land in it, refined by least squares. Draws are keyed
// by image, region and pixel: the same planes for any number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "phi/backend.h"
#include "phi/geometry/depth_precision.h"
#include "phi/geometry/device_camera.h"
#include "phi/inference/line_hypothesis.h"
#include "phi/inference/plane_fit.h"
#include "phi/inference/pooled_anchors.h"

namespace phi {

// 1 / z = a + b * x + c * y at array indices (x, y), within an ellipse around what carries the plane: the sides of a
// building carry one, and the sky that the building stands before is no part of it.
struct RegionPlane {
  double a = 0, b = 0, c = 0;
  // The ellipse: q = (x - center_x, y - center_y), xx * q.x^2 + 2 * xy * q.x * q.y + yy * q.y^2 <= 1.
  double center_x = 0, center_y = 0, xx = 0, xy = 0, yy = 0;

  // Anywhere on the plane.
  double InverseDepth(double x, double y) const { return a + b * x + c * y; }

  // The plane around (x, y).
  InverseDepthPlane Around(int x, int y) const {
    return {static_cast<float>(InverseDepth(x, y)), static_cast<float>(b), static_cast<float>(c), 1};
  }

  // 0 outside the ellipse.
  float At(int x, int y) const {
    const double dx = x - center_x, dy = y - center_y;
    if (xx * dx * dx + (2 * xy * dx + yy * dy) * dy > 1) return 0;
    const double w = InverseDepth(x, y);
    return w > 0 ? static_cast<float>(w) : 0;
  }
};

// Of the reference view, as its sources tell it.
DepthPrecision PrecisionOf(const InferenceInput& input);

// The image whose regions are found: the reference's, its mask cut out.
std::shared_ptr<const GrayImage> RegionImage(const InferenceInput& input);

class RegionPlanes {
 public:
  // `precision`: of the image's view.
  RegionPlanes(const GrayImage& image, ArrayView2D<const float> anchors, std::uint32_t image_id,
               std::span<const PooledAnchor> pooled = {}, const DepthPrecision& precision = {},
               const Rules& rules = {});

  // The planes of the pixel's region; those without anchors are 0 everywhere.
  const std::array<RegionPlane, kPlanesPerRegion>& At(int x, int y) const;

 private:
  Array2D<std::int32_t> region_;  // index into planes_, -1 = too few anchors
  std::vector<std::array<RegionPlane, kPlanesPerRegion>> planes_;
};

// Gives the filled pixels that took their depth from a region's plane that plane's normal: fitted again, the depths beside the
// plane would bend it.
void SetRegionNormals(const RegionPlanes& planes, const RayModel& rays, MeasurementMap* map);

}  // namespace phi
