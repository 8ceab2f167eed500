// Looks a reference pixel's point up in a neighbouring image: does that image's depth map agree with it?
//
// The neighbour's measurement is taken as a plane (depth and normal at its pixel) and intersected with the
// reference pixel's ray. Comparing depths along one ray is fair to slanted surfaces, where the neighbour's
// nearest pixel lies at quite another depth, and keeps every point on its own pixel's ray.
//
// Pure functions of a pixel: the CPU and a GPU may both call them, in any order.
#pragma once

#include "phi/fusion/fusion_pixel.h"
#include "phi/geometry/device_camera.h"

namespace phi {

// Thresholds in the units that the pixel's code compares; see FusionOptions.
struct FusionGates {
  float max_reproj_error = 2;
  float max_depth_error = 0.01f;
  float min_normal_cosine = 0.866f;
  float min_support = 0.6f;
  float max_conflicts = 1;
  int min_num_views = 2;
  int max_num_views = 10000;
};

// How a neighbour answers, in the order of the tests.
enum class Agreement { kUnseen, kNoDepth, kBehind, kSeenThrough, kDepth, kReprojection, kNormal, kAgrees };
inline constexpr int kNumAgreements = 8;

struct FusionNeighbor {
  std::uint32_t image = 0;  // index of the image in the model, as in .vis files
  bool earlier = false;     // decided before the reference image
  RelativeView view;
  float inverse_fx = 1, inverse_fy = 1;  // of view.source: divisions are dear here
  ArrayView2D<const FusionPixel> map;

  // The ray through the centre of a pixel, z = 1.
  PHI_HD Vec3f Ray(int column, int row) const {
    return {(column + 0.5f - view.source.cx) * inverse_fx, (row + 0.5f - view.source.cy) * inverse_fy, 1.0f};
  }
};

struct NeighborAnswer {
  Agreement agreement = Agreement::kUnseen;
  bool covers = false;  // the two pixels see the same spot, for the purpose of not giving it two points
  float relative_depth =
      0;  // of the neighbour's plane along the reference ray, over the reference depth, minus 1
  float reproj_error = 0;  // pixels of the neighbour, between the two points on the reference ray
  float normal_cosine = 0;
  Vec3f normal;  // of the neighbour, in the neighbour's frame
  const FusionPixel* pixel = nullptr;
};

// Least cosine between a ray and a neighbour's surface for their intersection to mean anything (87 degrees).
inline constexpr float kMinRayCosine = 0.05f;
// A neighbour sees through a point when its own surface lies beyond it by this many depth tolerances.
inline constexpr float kSeenThroughFactor = 3;
// Beyond this many depth tolerances no slant within a pixel explains the difference: spares the intersection.
inline constexpr float kHopelessFactor = 20;
// Noise puts pixels of one spot further apart than two that support each other may be. Covering them all the
// same keeps the fringe of the noise out of the cloud.
inline constexpr float kCoverFactor = 4;

struct ImagePoint {
  float u = 0, v = 0;  // pixels, K's coordinates
};

PHI_HD ImagePoint ProjectPoint(const RayModel& k, Vec3f x) {
  const float inverse_z = 1.0f / x.z;
  return {k.fx * x.x * inverse_z + k.cx, k.fy * x.y * inverse_z + k.cy};
}

// Whether the point is in front of the camera and inside the image.
PHI_HD bool InsideImage(const RayModel& k, Vec3f x, ImagePoint p) {
  return x.z > 0 && p.u >= 0 && p.v >= 0 && p.u < k.width && p.v < k.height;
}

// Asks about the point depth * ray of the reference image, whose normal there is `normal` (reference frame).
PHI_HD NeighborAnswer AskNeighbor(const FusionNeighbor& neighbor, Vec3f ray, float depth, Vec3f normal,
                                  const FusionGates& gates) {
  NeighborAnswer answer;
  const RelativeView& view = neighbor.view;
  const RayModel& k = view.source;
  const Vec3f direction = view.rotation * ray;
  const Vec3f x = depth * direction + view.translation;
  const ImagePoint seen = ProjectPoint(k, x);
  if (!InsideImage(k, x, seen)) return answer;
  const int column = static_cast<int>(seen.u), row = static_cast<int>(seen.v);
  const FusionPixel& pixel = neighbor.map(column, row);
  answer.pixel = &pixel;
  answer.agreement = Agreement::kNoDepth;
  if (!(pixel.depth > 0)) return answer;

  const float difference = pixel.depth - x.z;
  answer.agreement = difference > kSeenThroughFactor * gates.max_depth_error * x.z ? Agreement::kSeenThrough
                                                                                   : Agreement::kBehind;
  if (fabsf(difference) > kHopelessFactor * gates.max_depth_error * x.z) return answer;
  answer.normal = UnpackNormal(pixel.normal);
  const float slope = Dot(answer.normal, direction);
  if (!(slope < -kMinRayCosine)) return answer;
  const Vec3f on_plane = pixel.depth * neighbor.Ray(column, row);
  const float along = Dot(answer.normal, on_plane - view.translation) / slope;
  answer.relative_depth = along / depth - 1;
  if (!(fabsf(answer.relative_depth) <= kCoverFactor * gates.max_depth_error)) return answer;

  const Vec3f y = along * direction + view.translation;
  if (!(y.z > 0)) return answer;
  const ImagePoint agreed = ProjectPoint(k, y);
  const float du = agreed.u - seen.u, dv = agreed.v - seen.v;
  answer.reproj_error = sqrtf(du * du + dv * dv);
  answer.covers = answer.reproj_error <= kCoverFactor * gates.max_reproj_error;
  answer.agreement = Agreement::kDepth;
  if (!(fabsf(answer.relative_depth) <= gates.max_depth_error)) return answer;
  answer.agreement = Agreement::kReprojection;
  if (!(answer.reproj_error <= gates.max_reproj_error)) return answer;
  answer.normal_cosine = Dot(view.rotation * normal, answer.normal);
  answer.agreement =
      answer.normal_cosine >= gates.min_normal_cosine ? Agreement::kAgrees : Agreement::kNormal;
  return answer;
}

}  // namespace phi
