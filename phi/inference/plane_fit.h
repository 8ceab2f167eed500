// Least-squares plane through the depths around a pixel, in inverse depth: a plane is affine there (see
// phi/geometry/plane_hypothesis.h), whatever its slant.
#pragma once

#include <cmath>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/geometry/depth_agreement.h"

namespace phi {

inline constexpr int kPlaneFitRadius = 3;  // 7 x 7 window
// Inverse depth near pixel (x, y): value + slope_x * (x' - x) + slope_y * (y' - y), in 1 / world unit and
// 1 / (world unit * pixel). `count` pixels lie on it; 0 = no fit.
struct InverseDepthPlane {
  float value = 0, slope_x = 0, slope_y = 0;
  int count = 0;

  PHI_HD float At(float dx, float dy) const { return value + slope_x * dx + slope_y * dy; }
};

// Sums of the normal equations, with coordinates relative to the centre and values relative to the centre's value:
// all are small numbers, so single precision keeps an exact plane exact to rounding.
struct PlaneSums {
  float n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, w = 0, xw = 0, yw = 0;

  PHI_HD void Add(float dx, float dy, float dw) {
    n += 1;
    x += dx;
    y += dy;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
    w += dw;
    xw += dx * dw;
    yw += dy * dw;
  }

  // False when the pixels lie (nearly) on one line.
  PHI_HD bool Solve(float center, InverseDepthPlane* plane) const {
    if (n < 3) return false;
    const float mx = x / n, my = y / n, mw = w / n;
    const float cxx = xx - x * mx, cxy = xy - x * my, cyy = yy - y * my;
    const float cxw = xw - x * mw, cyw = yw - y * mw;
    const float det = cxx * cyy - cxy * cxy;
    if (!(det > 1e-3f * (cxx + cyy) * (cxx + cyy))) return false;
    plane->slope_x = (cxw * cyy - cyw * cxy) / det;
    plane->slope_y = (cyw * cxx - cxw * cxy) / det;
    plane->value = center + mw - plane->slope_x * mx - plane->slope_y * my;
    plane->count = static_cast<int>(n);
    return true;
  }
};

// Fits the 7 x 7 window around (x, y), two rounds: first the pixels whose inverse depth is near the centre's, then
// those near the first plane. inverse_depth <= 0 marks pixels without depth; the centre must have one.
PHI_HD InverseDepthPlane FitInverseDepthPlane(ArrayView2D<const float> inverse_depth, int x, int y) {
  const float center = inverse_depth(x, y);
  const float tolerance = kSameSurface * center;
  InverseDepthPlane plane;
  plane.value = center;
  const int x0 = x > kPlaneFitRadius ? x - kPlaneFitRadius : 0,
            y0 = y > kPlaneFitRadius ? y - kPlaneFitRadius : 0;
  const int x1 = x + kPlaneFitRadius < inverse_depth.width ? x + kPlaneFitRadius : inverse_depth.width - 1;
  const int y1 = y + kPlaneFitRadius < inverse_depth.height ? y + kPlaneFitRadius : inverse_depth.height - 1;
  for (int round = 0; round < 2; ++round) {
    PlaneSums sums;
    for (int v = y0; v <= y1; ++v) {
      for (int u = x0; u <= x1; ++u) {
        const float w = inverse_depth(u, v);
        const float dx = static_cast<float>(u - x), dy = static_cast<float>(v - y);
        if (w > 0 && fabsf(w - plane.At(dx, dy)) < tolerance) sums.Add(dx, dy, w - center);
      }
    }
    if (!sums.Solve(center, &plane)) return {};
  }
  return plane;
}

}  // namespace phi
