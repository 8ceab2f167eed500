// Geometric consistency of a depth between two views (paper section D).
#pragma once

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/filtering/filled_value.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/options.h"

namespace phi {

struct ConsistencyThresholds {
  float max_reprojection_error = 1;        // pixels in the reference image
  float max_relative_depth_error = 0.01f;  // of the depth in the source camera
  float min_normal_cosine = 0.8660254f;    // normals compared in the reference frame
  float max_ray_cosine = 1;                // cosine of the smallest triangulation angle that counts; 1 = any
  float max_depth_error = 0;               // world units, instead of the relative one; 0: the relative one
  Formulas formulas = Formulas::kRobust;
};

// Depth of `map` at (u, v): bilinear where the four taps agree within 1 % (paper: where they have depth), else the nearest
// pixel's. 0 = none.
PHI_HD float InterpolatedDepth(ArrayView2D<const PlaneHypothesis> map, float u, float v, Formulas formulas) {
  const int nearest_x = static_cast<int>(floorf(u)), nearest_y = static_cast<int>(floorf(v));
  if (!map.Contains(nearest_x, nearest_y)) return 0;
  const float nearest = map(nearest_x, nearest_y).depth;
  const float x = u - 0.5f, y = v - 0.5f;
  const int x0 = static_cast<int>(floorf(x)), y0 = static_cast<int>(floorf(y));
  if (!map.Contains(x0, y0) || !map.Contains(x0 + 1, y0 + 1) || !(nearest > 0)) return nearest;
  const float d00 = map(x0, y0).depth, d10 = map(x0 + 1, y0).depth;
  const float d01 = map(x0, y0 + 1).depth, d11 = map(x0 + 1, y0 + 1).depth;
  const float lowest = fminf(fminf(d00, d10), fminf(d01, d11)),
              highest = fmaxf(fmaxf(d00, d10), fmaxf(d01, d11));
  if (!(lowest > 0)) return nearest;
  if (formulas == Formulas::kRobust && highest - lowest > 0.01f * highest) return nearest;
  const float fx = x - x0, fy = y - y0;
  const float top = d00 + fx * (d10 - d00), bottom = d01 + fx * (d11 - d01);
  return top + fy * (bottom - top);
}

// True when `h` at the reference pixel (u, v) and the source map describe the same surface.
PHI_HD bool IsConsistent(const RayModel& reference, const RelativeView& view, float u, float v,
                         const PlaneHypothesis& h, ArrayView2D<const PlaneHypothesis> source_map,
                         const ConsistencyThresholds& t) {
  const Vec3f x_reference = h.depth * reference.Ray(u, v);
  const Vec3f x_source = view.rotation * x_reference + view.translation;
  if (!(x_source.z > 0)) return false;
  const float su = view.source.fx * x_source.x / x_source.z + view.source.cx;
  const float sv = view.source.fy * x_source.y / x_source.z + view.source.cy;
  const float depth = InterpolatedDepth(source_map, su, sv, t.formulas);
  if (!(depth > 0)) return false;

  const float difference = fabsf(x_source.z - depth);
  const float max_difference =
      t.max_depth_error > 0 ? t.max_depth_error : t.max_relative_depth_error * x_source.z;
  if (difference >= max_difference) return false;

  // Back from the source's own depth to the reference image.
  const Vec3f y_source = depth * view.source.Ray(su, sv);
  const Vec3f y_reference = TransposedTimes(view.rotation, y_source - view.translation);
  if (!(y_reference.z > 0)) return false;
  const float du = reference.fx * y_reference.x / y_reference.z + reference.cx - u;
  const float dv = reference.fy * y_reference.y / y_reference.z + reference.cy - v;
  if (!(du * du + dv * dv < t.max_reprojection_error * t.max_reprojection_error)) return false;

  const Vec3f source_normal = source_map(static_cast<int>(floorf(su)), static_cast<int>(floorf(sv))).normal;
  if (Dot(h.normal, TransposedTimes(view.rotation, source_normal)) < t.min_normal_cosine) return false;

  if (t.max_ray_cosine < 1) {
    // The angle at the point between the rays to both centres.
    const Vec3f to_source = x_source;  // in the source frame, from its centre
    const Vec3f to_reference = view.rotation * x_reference;
    const float cosine = Dot(to_source, to_reference) / (Norm(to_source) * Norm(to_reference));
    if (cosine > t.max_ray_cosine) return false;
  }
  return true;
}

}  // namespace phi
