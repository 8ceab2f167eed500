// Whether the planes around a pixel agree with its depth.
#pragma once

#include "phi/base/array2d.h"
#include "phi/geometry/device_camera.h"
#include "phi/geometry/plane_hypothesis.h"

namespace phi {

// A neighbour agrees when its plane, carried on to the pixel, differs from the pixel's depth by less than the greater of
// these: a share of the depth, and standard deviations of what matching can tell there: about one of the difference of two
// depths, so that two in three of the right neighbours agree. By the share alone, right neighbours contradict each other
// where baselines are short.
inline constexpr float kMaxNeighborError = 0.003f, kMaxNeighborDeviations = 1.5f;

inline constexpr int kNeighborRadius = 2;  // 5 x 5 pixels are asked, one or more pixels apart
inline constexpr int kNumNeighbors = (2 * kNeighborRadius + 1) * (2 * kNeighborRadius + 1) - 1;

// Share of its depth that a neighbour's plane may be off. deviation: what matching can tell of the depth, relative.
PHI_HD float NeighborTolerance(float deviation) {
  const float tolerance = kMaxNeighborDeviations * deviation;
  return tolerance > kMaxNeighborError ? tolerance : kMaxNeighborError;
}

// How many of the neighbours of (x, y), `spacing` pixels apart, agree with it. A plane meets a pixel's ray at offset / (n . ray), the
// pixel's depth where offset = depth (n . ray). The pixel has depth.
PHI_HD int CountAgreeingAround(const RayModel& rays, ArrayView2D<const PlaneHypothesis> map, int x, int y, int spacing, float deviation) {
  const float depth = map(x, y).depth, tolerance = NeighborTolerance(deviation);
  const Vec3f ray = rays.Ray(x + 0.5f, y + 0.5f);
  int count = -1;  // the pixel itself is no neighbour, and always agrees
  for (int v = y - kNeighborRadius * spacing; v <= y + kNeighborRadius * spacing; v += spacing) {
    for (int u = x - kNeighborRadius * spacing; u <= x + kNeighborRadius * spacing; u += spacing) {
      if (!map.Contains(u, v)) continue;
      const PlaneHypothesis plane = map(u, v);
      const float offset = plane.depth * Dot(plane.normal, rays.Ray(u + 0.5f, v + 0.5f)), here = depth * Dot(plane.normal, ray);
      count += plane.depth > 0 && fabsf(offset - here) < tolerance * fabsf(here) ? 1 : 0;
    }
  }
  return count;
}

}  // namespace phi
