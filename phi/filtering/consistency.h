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

// What a map holds around a place (u, v).
struct MapTaps {
  float nearest = 0;  // the nearest pixel's depth; 0: none, or beside the map
  Vec3f normal = {};  // its normal
  float d00 = 0, d10 = 0, d01 = 0, d11 = 0;  // of the four pixels around; 0 where one of them lies beside the map
  float fx = 0, fy = 0;                      // how far from the first to the last of them
};

PHI_HD MapTaps ReadTaps(ArrayView2D<const PlaneHypothesis> map, float u, float v) {
  const int nearest_x = static_cast<int>(floorf(u)), nearest_y = static_cast<int>(floorf(v));
  MapTaps taps;
  if (!map.Contains(nearest_x, nearest_y)) return taps;
  const PlaneHypothesis& h = map(nearest_x, nearest_y);
  taps.nearest = h.depth;
  taps.normal = h.normal;
  const float x = u - 0.5f, y = v - 0.5f;
  const int x0 = static_cast<int>(floorf(x)), y0 = static_cast<int>(floorf(y));
  if (!map.Contains(x0, y0) || !map.Contains(x0 + 1, y0 + 1)) return taps;
  taps.d00 = map(x0, y0).depth, taps.d10 = map(x0 + 1, y0).depth;
  taps.d01 = map(x0, y0 + 1).depth, taps.d11 = map(x0 + 1, y0 + 1).depth;
  taps.fx = x - x0, taps.fy = y - y0;
  return taps;
}

// Bilinear where the four taps agree within 1 % (paper: where they have depth), else the nearest pixel's. 0 = none. No branch tells one
// place from the next, so that a processor works on several.
PHI_HD float InterpolatedDepth(const MapTaps& taps, Formulas formulas, float same_depth = kSameDepth) {
  const float lowest = Min(Min(taps.d00, taps.d10), Min(taps.d01, taps.d11));
  const float highest = Max(Max(taps.d00, taps.d10), Max(taps.d01, taps.d11));
  const bool is_one_surface = (formulas != Formulas::kRobust) | !(highest - lowest > same_depth * highest);
  const float top = taps.d00 + taps.fx * (taps.d10 - taps.d00), bottom = taps.d01 + taps.fx * (taps.d11 - taps.d01);
  const float blended = top + taps.fy * (bottom - top);
  return (taps.nearest > 0) & (lowest > 0) & is_one_surface ? blended : taps.nearest;
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

// Where the point lies behind the source camera, `at_source` means nothing.
PHI_HD ProjectedPoint ProjectHypothesis(const RayModel& reference, ImagePoint at, float depth, const RelativeView& view) {
  ProjectedPoint point;
  point.at_reference = at;
  point.in_reference = depth * reference.Ray(at.u, at.v);
  point.in_source = view.rotation * point.in_reference + view.translation;
  point.at_source = view.source.Project(point.in_source);
  return point;
}

// Whether the source view could see the hypothesis, but for what may lie before it.
PHI_HD bool FacesView(const FilterSource& source, Vec3f normal, const ProjectedPoint& point, const ConsistencyThresholds& t) {
  const ImagePoint at = point.at_source;
  const bool is_within = (at.u >= t.window_reach) & (at.v >= t.window_reach) & (at.u <= source.map.width - t.window_reach) &
                         (at.v <= source.map.height - t.window_reach);
  const float distance = Norm(point.in_source);
  const Vec3f ray =
      TransposedTimes(source.view.rotation, point.in_source);  // from the source's centre, in the reference's axes
  const bool is_faced = -Dot(normal, ray) > t.min_facing_cosine * distance;
  const bool is_near_by = Dot(ray, point.in_reference) > t.min_rays_cosine * distance * Norm(point.in_reference);
  return is_within & is_faced & is_near_by;
}

// Of a hypothesis and what a source's map holds where its point is seen: whether both describe one surface.
enum class Agreement : std::uint8_t { kNothingThere, kNone, kWithin, kClose };  // kNothingThere: the map has no depth

// `point`: of a hypothesis with that normal. `taps`: of the source's map where it sees the point. All of it is worked out wherever the
// point lies, without branches as in InterpolatedDepth.
PHI_HD Agreement CompareWithMap(const RayModel& reference, const RelativeView& view, Vec3f normal, const ProjectedPoint& point,
                                const MapTaps& taps, const ConsistencyThresholds& t) {
  const ImagePoint at = point.at_source;
  const float depth = InterpolatedDepth(taps, t.formulas, t.same_depth);
  const float own_depth = point.in_source.z;
  const float max_depth_error = t.max_depth_error > 0 ? t.max_depth_error : t.max_relative_depth_error * own_depth;
  const bool depths_agree = fabsf(own_depth - depth) < max_depth_error;

  // Back from the source's own depth to the reference image.
  const Vec3f y_source = depth * view.source.Ray(at.u, at.v);
  const Vec3f y_reference = TransposedTimes(view.rotation, y_source - view.translation);
  const ImagePoint met = reference.Project(y_reference);
  const float du = met.u - point.at_reference.u, dv = met.v - point.at_reference.v;
  const float error = sqrtf(du * du + dv * dv);
  const bool meets = (y_reference.z > 0) & (error < t.max_reprojection_error);

  const bool normals_agree = !(Dot(normal, TransposedTimes(view.rotation, taps.normal)) < t.min_normal_cosine);

  // The angle at the point between the rays to both centres.
  const Vec3f to_reference = view.rotation * point.in_reference;
  const float cosine = Dot(point.in_source, to_reference) / (Norm(point.in_source) * Norm(to_reference));
  const bool is_wide = (t.max_ray_cosine >= 1) | !(cosine > t.max_ray_cosine);

  const bool is_close = DepthsAgree(own_depth, depth, t.close_depth * t.max_relative_depth_error) &
                        (error < t.close_reprojection * t.max_reprojection_error);
  const Agreement if_same = is_close ? Agreement::kClose : Agreement::kWithin;
  const Agreement if_there = depths_agree & meets & normals_agree & is_wide ? if_same : Agreement::kNone;
  return depth > 0 ? if_there : Agreement::kNothingThere;
}

PHI_HD bool IsLeftOut(ArrayView2D<const std::uint8_t> mask, ImagePoint at) {
  const int x = static_cast<int>(floorf(at.u)), y = static_cast<int>(floorf(at.v));
  return mask.data != nullptr && mask.Contains(x, y) && mask(x, y) == 0;
}

// What follows from a source's map and from what lies before the point in it.
PHI_HD Testimony TestimonyOf(const FilterSource& source, const ProjectedPoint& point, Agreement agreement, bool faces_view, float gap) {
  if (!(point.in_source.z > 0) || IsLeftOut(source.mask, point.at_source)) return Testimony::kNone;
  if (agreement == Agreement::kClose) return Testimony::kConfirmsClosely;
  if (agreement == Agreement::kWithin) return Testimony::kConfirms;
  // What hides the point is looked for only here: it takes nine reads.
  if (!faces_view || IsHidden(source.map, point.at_source.u, point.at_source.v, point.in_source.z, gap)) return Testimony::kNone;
  return agreement == Agreement::kNothingThere ? Testimony::kFindsNothing : Testimony::kContradicts;
}

// Of the source view about `h` at a point of the reference image.
PHI_HD Testimony Ask(const RayModel& reference, ImagePoint at, const PlaneHypothesis& h, const FilterSource& source,
                     const ConsistencyThresholds& t) {
  const ProjectedPoint point = ProjectHypothesis(reference, at, h.depth, source.view);
  if (!(point.in_source.z > 0)) return Testimony::kNone;
  const MapTaps taps = ReadTaps(source.map, point.at_source.u, point.at_source.v);
  const Agreement agreement = CompareWithMap(reference, source.view, h.normal, point, taps, t);
  return TestimonyOf(source, point, agreement, FacesView(source, h.normal, point, t), t.depth_gap);
}

}  // namespace phi
