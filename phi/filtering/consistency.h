// Geometric consistency of a depth between two views (paper section D).
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/geometry/depth_agreement.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/options.h"

namespace phi {

// Shares of the thresholds. One view alone is believed only this close: by chance a depth comes so near less than half as often.
inline constexpr float kCloseDepth = 0.4f, kCloseReprojection = 0.5f;
// Where a window around the pixel does not fit into the image there is no matching; pixels.
inline constexpr float kWindowReach = 5;
// Cosines of the angles beyond which no window matches: of the surface against the source's ray (80 degrees) and between
// the rays of both views (60 degrees).
inline constexpr float kMinFacingCosine = 0.17f, kMinRaysCosine = 0.5f;

struct ConsistencyThresholds {
  float max_reprojection_error = 1;        // pixels in the reference image
  float max_relative_depth_error = 0.01f;  // of the depth in the source camera
  float min_normal_cosine = 0.5f;          // normals compared in the reference frame
  float max_ray_cosine = 1;                // cosine of the smallest triangulation angle that counts; 1 = any
  float max_depth_error = 0;               // world units, instead of the relative one; 0: the relative one
  Formulas formulas = Formulas::kRobust;
  float same_depth = kSameDepth;  // of the four taps of a bilinear depth
  // What a close confirmation is, and which views could see a point: the constants above.
  float close_depth = kCloseDepth, close_reprojection = kCloseReprojection, window_reach = kWindowReach;
  float min_facing_cosine = kMinFacingCosine, min_rays_cosine = kMinRaysCosine, depth_gap = kDepthGap;
};

// Depth of `map` at (u, v): bilinear where the four taps agree within 1 % (paper: where they have depth), else the nearest
// pixel's. 0 = none.
PHI_HD float InterpolatedDepth(ArrayView2D<const PlaneHypothesis> map, float u, float v, Formulas formulas,
                               float same_depth = kSameDepth) {
  const int nearest_x = static_cast<int>(floorf(u)), nearest_y = static_cast<int>(floorf(v));
  if (!map.Contains(nearest_x, nearest_y)) return 0;
  const float nearest = map(nearest_x, nearest_y).depth;
  const float x = u - 0.5f, y = v - 0.5f;
  const int x0 = static_cast<int>(floorf(x)), y0 = static_cast<int>(floorf(y));
  if (!map.Contains(x0, y0) || !map.Contains(x0 + 1, y0 + 1) || !(nearest > 0)) return nearest;
  const float d00 = map(x0, y0).depth, d10 = map(x0 + 1, y0).depth;
  const float d01 = map(x0, y0 + 1).depth, d11 = map(x0 + 1, y0 + 1).depth;
  const float lowest = Min(Min(d00, d10), Min(d01, d11)), highest = Max(Max(d00, d10), Max(d01, d11));
  if (!(lowest > 0)) return nearest;
  if (formulas == Formulas::kRobust && highest - lowest > same_depth * highest) return nearest;
  const float fx = x - x0, fy = y - y0;
  const float top = d00 + fx * (d10 - d00), bottom = d01 + fx * (d11 - d01);
  return top + fy * (bottom - top);
}

// What a source view's map says of a hypothesis.
enum class Testimony : std::uint8_t {
  kNone,             // the view cannot see the point, or its mask leaves it out
  kFindsNothing,     // it could, and its map has no depth there
  kContradicts,      // it could, and its map shows another surface
  kConfirms,         // both describe one surface
  kConfirmsClosely,  // the same within kCloseDepth and kCloseReprojection of the thresholds
};

// Whether the point, in the source's frame and at (su, sv) of its image, lies behind what the source's map holds at most of the
// pixels around: one wrong pixel of a map that nobody has judged yet hides nothing.
PHI_HD bool IsHidden(ArrayView2D<const PlaneHypothesis> source_map, float su, float sv, float depth,
                     float gap) {
  constexpr int kSpacing = 2;
  int asked = 0, nearer = 0;
  for (int dy = -kSpacing; dy <= kSpacing; dy += kSpacing) {
    for (int dx = -kSpacing; dx <= kSpacing; dx += kSpacing) {
      const int x = static_cast<int>(floorf(su)) + dx, y = static_cast<int>(floorf(sv)) + dy;
      if (!source_map.Contains(x, y) || !(source_map(x, y).depth > 0)) continue;
      ++asked;
      nearer += LiesBefore(source_map(x, y).depth, depth, gap);
    }
  }
  return 2 * nearer > asked;
}

// A source view relative to the reference, its map, and what its mask leaves out.
struct FilterSource {
  RelativeView view;
  ArrayView2D<const PlaneHypothesis> map;
  ArrayView2D<const std::uint8_t> mask = {};  // of the map's size, 0: left out; no data: nothing is
};

// A hypothesis's point in the frames of both cameras, and where they see it.
struct ProjectedPoint {
  Vec3f in_reference, in_source;
  ImagePoint at_reference, at_source;
};

// Whether the source view can see the hypothesis at all.
PHI_HD bool CanSee(const FilterSource& source, const PlaneHypothesis& h, const ProjectedPoint& point,
                   const ConsistencyThresholds& t) {
  const ImagePoint at = point.at_source;
  if (!(at.u >= t.window_reach && at.v >= t.window_reach && at.u <= source.map.width - t.window_reach &&
        at.v <= source.map.height - t.window_reach)) {
    return false;
  }
  const float distance = Norm(point.in_source);
  const Vec3f ray =
      TransposedTimes(source.view.rotation, point.in_source);  // from the source's centre, in the reference's axes
  if (!(-Dot(h.normal, ray) > t.min_facing_cosine * distance)) return false;
  if (!(Dot(ray, point.in_reference) > t.min_rays_cosine * distance * Norm(point.in_reference))) return false;
  return !IsHidden(source.map, at.u, at.v, point.in_source.z, t.depth_gap);
}

// Of a hypothesis and what a source's map holds where its point is seen: whether both describe one surface.
enum class Agreement : std::uint8_t { kNothingThere, kNone, kWithin, kClose };  // kNothingThere: the map has no depth

// `point`: of `h`.
PHI_HD Agreement CompareWithMap(const RayModel& reference, const FilterSource& source, const PlaneHypothesis& h,
                                const ProjectedPoint& point, const ConsistencyThresholds& t) {
  const RelativeView& view = source.view;
  const ImagePoint at = point.at_source;
  const float depth = InterpolatedDepth(source.map, at.u, at.v, t.formulas, t.same_depth);
  if (!(depth > 0)) return Agreement::kNothingThere;

  const float own_depth = point.in_source.z;
  const bool depths_agree = t.max_depth_error > 0 ? fabsf(own_depth - depth) < t.max_depth_error
                                                  : DepthsAgree(own_depth, depth, t.max_relative_depth_error);
  if (!depths_agree) return Agreement::kNone;

  // Back from the source's own depth to the reference image.
  const Vec3f y_source = depth * view.source.Ray(at.u, at.v);
  const Vec3f y_reference = TransposedTimes(view.rotation, y_source - view.translation);
  if (!(y_reference.z > 0)) return Agreement::kNone;
  const ImagePoint met = reference.Project(y_reference);
  const float du = met.u - point.at_reference.u, dv = met.v - point.at_reference.v;
  const float error = sqrtf(du * du + dv * dv);
  if (!(error < t.max_reprojection_error)) return Agreement::kNone;

  const Vec3f source_normal = source.map(static_cast<int>(floorf(at.u)), static_cast<int>(floorf(at.v))).normal;
  if (Dot(h.normal, TransposedTimes(view.rotation, source_normal)) < t.min_normal_cosine) return Agreement::kNone;

  if (t.max_ray_cosine < 1) {
    // The angle at the point between the rays to both centres.
    const Vec3f to_reference = view.rotation * point.in_reference;
    const float cosine = Dot(point.in_source, to_reference) / (Norm(point.in_source) * Norm(to_reference));
    if (cosine > t.max_ray_cosine) return Agreement::kNone;
  }
  const bool is_close = DepthsAgree(own_depth, depth, t.close_depth * t.max_relative_depth_error) &&
                        error < t.close_reprojection * t.max_reprojection_error;
  return is_close ? Agreement::kClose : Agreement::kWithin;
}

PHI_HD bool IsLeftOut(ArrayView2D<const std::uint8_t> mask, ImagePoint at) {
  const int x = static_cast<int>(floorf(at.u)), y = static_cast<int>(floorf(at.v));
  return mask.data != nullptr && mask.Contains(x, y) && mask(x, y) == 0;
}

// Of the source view about `h` at a point of the reference image.
PHI_HD Testimony Ask(const RayModel& reference, ImagePoint at, const PlaneHypothesis& h, const FilterSource& source,
                     const ConsistencyThresholds& t) {
  ProjectedPoint point;
  point.at_reference = at;
  point.in_reference = h.depth * reference.Ray(at.u, at.v);
  point.in_source = source.view.rotation * point.in_reference + source.view.translation;
  if (!(point.in_source.z > 0)) return Testimony::kNone;
  point.at_source = source.view.source.Project(point.in_source);
  if (IsLeftOut(source.mask, point.at_source)) return Testimony::kNone;
  const Agreement agreement = CompareWithMap(reference, source, h, point, t);
  if (agreement == Agreement::kClose) return Testimony::kConfirmsClosely;
  if (agreement == Agreement::kWithin) return Testimony::kConfirms;
  // What hides the point is looked for only here: it takes nine reads.
  if (!CanSee(source, h, point, t)) return Testimony::kNone;
  return agreement == Agreement::kNothingThere ? Testimony::kFindsNothing : Testimony::kContradicts;
}

}  // namespace phi
