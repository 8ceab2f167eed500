// The support rule of fusion for one pixel, as one would read it, and as a GPU runs it. On the host support_run does the same
// operations in the same order for 16 pixels at once; tests compare the three to the bit. So nothing here may be compiled to fused
// multiply-adds.
#pragma once

#include <cmath>
#include <cstdint>

#include "phi/fusion/neighbor_lookup.h"
#include "phi/fusion/neighbor_set.h"
#include "phi/fusion/pixel_outcome.h"

namespace phi {

// A pixel of the reference image and its ray, z = 1.
struct ReferencePixel {
  FusionPixel pixel;
  Vec3f ray;
  float fx = 1;  // of the reference camera
};

// What one image says about a reference pixel, in the order of the tests (neighbor_lookup.h).
enum class NeighborTest { kBlind, kWithoutDepth, kOtherDepth, kOtherReprojection, kOtherNormal, kAgrees };

struct NeighborAnswer {
  NeighborTest test = NeighborTest::kBlind;
  bool covers = false;         // a point of its own stands for the pixel; the rest means nothing then
  bool sees_through = false;   // it measured a surface beyond the point
  bool is_hidden = false;      // its surface lies before the point
  float relative_depth = 0;    // of its plane along the reference ray, over the reference depth, minus 1
  float agreement = 0;         // [0, 1]: how well reprojection and normal agree
  Vec3f normal;                // reference frame
  FusionPixel pixel;           // what it holds there
};

// The point that a pixel gives: sums over the images near the consensus, which is the median of the agreeing depths.
struct PointSupport {
  float relative_depth = 0;  // of the consensus, over the pixel's own depth, minus 1
  int num_views = 0, num_inferred = 0;
  int rgb_sum[3] = {0, 0, 0};
  int brightness_squares = 0;  // sum of (red + green + blue)^2
  Vec3f normal_sum;  // reference frame, weighted by agreement
  float least_cosine = 1;  // between the reference's ray to it and another image's
};

// What the images make of a pixel together. Of a pixel without depth, or a covered one, only that is told.
struct PixelSupport {
  bool has_depth = false, is_covered = false;
  // Images by their answers; num_agreeing with the reference itself.
  int num_without_depth = 0;  // that look there
  int num_other_depth = 0, num_other_reprojection = 0, num_other_normal = 0, num_agreeing = 0;
  int num_seen_through = 0, num_hidden = 0;  // among num_other_depth
  bool reference_is_near = false;  // to the consensus
  float support = 0;               // sum of the other images' agreements, depth included
  PointSupport point;
  NeighborSet views;  // neighbours near the consensus
};

// What speaks against a point: point_confidence.h tells from it how probable the point is.
struct PointDoubts {
  std::uint16_t num_contradicting = 0;  // images that have another depth there, unless something hides the point from them
  std::uint16_t num_without_depth = 0;  // that look there and have none
};

// A pixel that gives a point, before a bounding box is asked.
struct FusedPixel {
  std::uint32_t pixel = 0;  // its number in its map, row by row
  PointSupport point;
  PointDoubts doubts;
  NeighborSet views;
};

// 1 at no error, 0 at the gate and beyond.
PHI_HD float SoftAgreement(float error, float gate) {
  const float r = error / gate;
  return r < 1 ? 1 - r * r : 0;
}

// A pixel's longest step along a surface is depth / (focal length * slant cosine). The reference's normal serves both sides,
// so that noise in normals matters little.
PHI_HD bool SamplesFinely(const FusionNeighbor& neighbor, const FusionGates& gates, const ReferencePixel& reference,
                          float their_depth, Vec3f point) {
  const Vec3f normal = UnpackNormal(reference.pixel.normal);
  const float slant = Max(gates.min_slant_cosine, -Dot(normal, reference.ray));
  const float their_slant = Max(gates.min_slant_cosine, -(Dot(neighbor.view.rotation * normal, point) / point.z));
  return their_depth * reference.fx * slant <=
         gates.max_coarsening * neighbor.view.source.fx * reference.pixel.depth * their_slant;
}

PHI_HD NeighborAnswer AskNeighbor(const FusionNeighbor& neighbor, const FusionGates& gates, const ReferencePixel& reference) {
  NeighborAnswer answer;
  const RayModel& k = neighbor.view.source;
  const float own_depth = reference.pixel.depth;
  const Vec3f direction = neighbor.view.rotation * reference.ray;
  const Vec3f point = own_depth * direction + neighbor.view.translation;
  const ImagePoint seen = ProjectPoint(k, point);
  if (!InsideImage(k, point, seen)) return answer;
  const int column = static_cast<int>(seen.u), row = static_cast<int>(seen.v);
  answer.pixel = neighbor.map(column, row);
  const float depth = answer.pixel.depth;
  answer.test = NeighborTest::kWithoutDepth;
  if (!(depth > 0)) return answer;

  answer.test = NeighborTest::kOtherDepth;
  const float difference = depth - point.z;
  const float apart = gates.seen_through_factor * gates.max_depth_error * point.z;
  answer.is_hidden = difference < -apart;
  answer.sees_through = difference > apart && (answer.pixel.flags & FusionPixel::kInferred) == 0;
  if (fabsf(difference) > gates.hopeless_factor * gates.max_depth_error * point.z) return answer;

  // The neighbour's plane, met by the reference ray.
  const Vec3f normal = UnpackNormal(answer.pixel.normal);
  const float slope = Dot(normal, direction);
  const Vec3f offset = depth * neighbor.Ray(column, row) - neighbor.view.translation;
  const float along = Dot(normal, offset) / slope;
  answer.relative_depth = along / own_depth - 1;
  const Vec3f met = along * direction + neighbor.view.translation;
  const bool meets = slope < -gates.min_ray_cosine && met.z > 0 &&
                     fabsf(answer.relative_depth) <= gates.cover_factor * gates.max_depth_error;
  if (!meets) return answer;
  answer.sees_through = answer.is_hidden = false;
  const ImagePoint agreed = ProjectPoint(k, met);
  const float du = agreed.u - seen.u, dv = agreed.v - seen.v;
  const float reproj_error = sqrtf(du * du + dv * dv);
  answer.covers = neighbor.earlier && reproj_error <= gates.max_reproj_error &&
                  (answer.pixel.flags & FusionPixel::kEmitted) != 0 &&
                  SamplesFinely(neighbor, gates, reference, depth, point);

  if (!(fabsf(answer.relative_depth) <= gates.max_depth_error)) return answer;
  answer.test = NeighborTest::kOtherReprojection;
  if (!(reproj_error <= gates.max_reproj_error)) return answer;
  answer.test = NeighborTest::kOtherNormal;
  const float cosine = Dot(neighbor.view.rotation * UnpackNormal(reference.pixel.normal), normal);
  if (!(cosine >= gates.min_normal_cosine)) return answer;
  answer.test = NeighborTest::kAgrees;
  answer.agreement =
      SoftAgreement(reproj_error, gates.max_reproj_error) * SoftAgreement(1 - cosine, 1 - gates.min_normal_cosine);
  answer.normal = TransposedTimes(neighbor.view.rotation, normal);
  return answer;
}

// Depths in ascending order.
class SortedDepths {
 public:
  PHI_HD int size() const { return size_; }
  PHI_HD void Insert(float depth) {
    int i = size_++;
    for (; i > 0 && depths_[i - 1] > depth; --i) depths_[i] = depths_[i - 1];
    depths_[i] = depth;
  }
  PHI_HD float Median() const { return 0.5f * (depths_[(size_ - 1) / 2] + depths_[size_ / 2]); }

 private:
  float depths_[kMaxFusionNeighbors + 1];
  int size_ = 0;
};

// Adds what an image holds to the point if it is near the consensus. Returns how near: 0 means that it is not.
PHI_HD float AddView(const FusionGates& gates, const FusionPixel& pixel, Vec3f normal, float relative_depth, float agreement,
                     PointSupport* point) {
  const float nearness = SoftAgreement(fabsf(relative_depth - point->relative_depth), gates.max_depth_error);
  if (!(nearness > 0)) return 0;
  point->normal_sum = point->normal_sum + agreement * normal;
  for (int c = 0; c < 3; ++c) point->rgb_sum[c] += pixel.rgb[c];
  const int brightness = pixel.rgb[0] + pixel.rgb[1] + pixel.rgb[2];
  point->brightness_squares += brightness * brightness;
  point->num_inferred += (pixel.flags & FusionPixel::kInferred) != 0 ? 1 : 0;
  ++point->num_views;
  return nearness;
}

// Between the rays from the reference's camera and the neighbour's to a point in the reference's frame.
PHI_HD float CosineOfRays(Vec3f point, const FusionNeighbor& neighbor) {
  const Vec3f theirs = point - neighbor.center;
  return Dot(point, theirs) / sqrtf(Dot(point, point) * Dot(theirs, theirs));
}

// At most kMaxFusionNeighbors neighbours.
PHI_HD PixelSupport DecidePixel(const FusionNeighbor* neighbors, int num_neighbors, const FusionGates& gates,
                                const ReferencePixel& reference) {
  PixelSupport result;
  result.has_depth = reference.pixel.depth > 0;
  if (!result.has_depth) return result;
  SortedDepths depths;
  depths.Insert(0);  // the reference's own, relative to itself
  NeighborSet agreeing;
  for (int k = 0; k < num_neighbors; ++k) {
    const NeighborAnswer answer = AskNeighbor(neighbors[k], gates, reference);
    result.is_covered = answer.covers;
    if (result.is_covered) return result;
    if (!neighbors[k].stands_apart) continue;
    result.num_without_depth += answer.test == NeighborTest::kWithoutDepth ? 1 : 0;
    result.num_other_depth += answer.test == NeighborTest::kOtherDepth ? 1 : 0;
    result.num_other_reprojection += answer.test == NeighborTest::kOtherReprojection ? 1 : 0;
    result.num_other_normal += answer.test == NeighborTest::kOtherNormal ? 1 : 0;
    result.num_seen_through += answer.sees_through ? 1 : 0;
    result.num_hidden += answer.is_hidden ? 1 : 0;
    if (answer.test != NeighborTest::kAgrees || depths.size() >= gates.max_num_views) continue;
    depths.Insert(answer.relative_depth);
    agreeing.Add(k);
  }
  result.num_agreeing = depths.size();

  PointSupport& point = result.point;
  point.relative_depth = depths.Median();
  point.normal_sum = {0, 0, 0};
  result.reference_is_near = AddView(gates, reference.pixel, UnpackNormal(reference.pixel.normal), 0, 1, &point) > 0;
  const Vec3f position = reference.pixel.depth * (1 + point.relative_depth) * reference.ray;
  for (int k = 0; k < num_neighbors; ++k) {
    if (!agreeing.Contains(k)) continue;
    const NeighborAnswer answer = AskNeighbor(neighbors[k], gates, reference);  // once more costs less than to keep all
    const float nearness =
        AddView(gates, answer.pixel, answer.normal, answer.relative_depth, answer.agreement, &point);
    if (!(nearness > 0)) continue;
    result.support += nearness * answer.agreement;
    point.least_cosine = Min(CosineOfRays(position, neighbors[k]), point.least_cosine);
    result.views.Add(k);
  }
  return result;
}

PHI_HD PointDoubts DoubtsOf(const PixelSupport& support) {
  const int num_left_out = support.num_agreeing - support.point.num_views;  // agree with the pixel, but not with the consensus
  const int num_contradicting = support.num_other_depth - support.num_hidden + support.num_other_reprojection +
                                support.num_other_normal + num_left_out;
  return {static_cast<std::uint16_t>(num_contradicting), static_cast<std::uint16_t>(support.num_without_depth)};
}

// What becomes of a pixel, by what the images make of it. kFused: unless its point lies outside the box.
PHI_HD PixelOutcome JudgePixel(const FusionGates& gates, const PixelSupport& support, bool is_inferred) {
  if (!support.has_depth) return PixelOutcome::kNoDepth;
  if (support.is_covered) return PixelOutcome::kCovered;
  // The test without which enough images would have agreed, or the nearest to it.
  int num_views = support.num_agreeing;
  if (num_views < gates.min_num_views) {
    if ((num_views += support.num_other_normal) >= gates.min_num_views) return PixelOutcome::kNormal;
    if ((num_views += support.num_other_reprojection) >= gates.min_num_views) return PixelOutcome::kReprojection;
    return num_views + support.num_other_depth >= gates.min_num_views ? PixelOutcome::kDepth : PixelOutcome::kTooFewViews;
  }
  num_views = support.point.num_views;
  if (num_views < gates.min_num_views || !support.reference_is_near) return PixelOutcome::kDepth;
  const float min_support = is_inferred ? gates.min_support_inferred : gates.min_support;
  if (gates.min_num_views > 1 && support.support < min_support) return PixelOutcome::kWeakSupport;
  const int num_others = num_views > 1 ? num_views - 1 : 1;
  const bool is_seen_through =
      static_cast<float>(support.num_seen_through) > gates.max_conflicts * static_cast<float>(num_others);
  return is_seen_through ? PixelOutcome::kSeenThrough : PixelOutcome::kFused;
}

}  // namespace phi
