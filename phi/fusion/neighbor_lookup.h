// Looks a reference pixel's point up in a neighbouring image: does that image's depth map agree with it?
//
// The neighbour's measurement is taken as a plane (depth and normal at its pixel) and intersected with the
// reference pixel's ray. Comparing depths along one ray is fair to slanted surfaces, where the neighbour's
// nearest pixel lies at quite another depth, and keeps every point on its own pixel's ray.
//
// An image answers, in the order of the tests: it does not see the point; it has no depth there; its surface lies
// before the point, or beyond it (it sees through the point, if it measured that surface); the depths differ, the
// reprojection error is too large, the normals differ; or it agrees.
#pragma once

#include <cstddef>
#include <cstdint>

#include "phi/fusion/fusion_pixel.h"
#include "phi/geometry/device_camera.h"

namespace phi {

// Least cosine between a ray and a neighbour's surface for their intersection to mean anything (87 degrees).
inline constexpr float kMinRayCosine = 0.05f;
// A neighbour sees through a point when its own surface lies beyond it by this many depth tolerances.
inline constexpr float kSeenThroughFactor = 3;
// Beyond this many depth tolerances no slant within a pixel explains the difference: spares the intersection.
inline constexpr float kHopelessFactor = 20;
// Noise puts depths of one spot further apart than two that support each other may be. Covering them all the same keeps
// the fringe of the noise out of the cloud. In depth tolerances.
inline constexpr float kCoverFactor = 4;

// A pixel is covered only by one whose steps along the surface are at most so many times its own: what an image sees
// at a grazing angle does not stand for what another sees from the front.
inline constexpr float kMaxCoarsening = 1.2f;
// Least cosine of a slant in that comparison (84 degrees): normals are not exact enough to tell more.
inline constexpr float kMinSlantCosine = 0.1f;

// Thresholds in the units that the pixel's code compares; see FusionOptions.
struct FusionGates {
  float max_reproj_error = 8;
  float max_depth_error = 0.01f;
  float min_normal_cosine = 0.99f;
  float min_support = 0, min_support_inferred = 0.5f;
  float max_conflicts = 0.5f;
  int min_num_views = 2;
  int max_num_views = 10000;
  float min_ray_cosine = kMinRayCosine, seen_through_factor = kSeenThroughFactor,
        hopeless_factor = kHopelessFactor;
  float cover_factor = kCoverFactor, max_coarsening = kMaxCoarsening, min_slant_cosine = kMinSlantCosine;
};

struct FusionNeighbor {
  std::uint32_t image = 0;  // index of the image in the model, as in .vis files
  bool earlier = false;     // decided before the reference image
  RelativeView view;
  float inverse_fx = 1, inverse_fy = 1;  // of view.source: divisions are dear here
  ArrayView2D<const FusionPixel> map;
  // From the reference. One at the same place, which has the same depths right and wrong, covers pixels and tells nothing else.
  bool stands_apart = true;
  Vec3f center = {};  // of its camera, in the reference's frame

  // The ray through the centre of a pixel, z = 1.
  PHI_HD Vec3f Ray(int column, int row) const {
    return {(column + 0.5f - view.source.cx) * inverse_fx, (row + 0.5f - view.source.cy) * inverse_fy, 1.0f};
  }
};

// An upper bound for the neighbours of one image.
inline constexpr int kMaxFusionNeighbors = 256;
// And for the pixels of a map, whose words are numbered in 31 bits.
inline constexpr std::size_t kMaxFusionPixels = 0x7fffffff / FusionPixel::kNumWords;

// RayModel::Project with one division instead of two: what the vector form does.
PHI_HD ImagePoint ProjectPoint(const RayModel& k, Vec3f x) {
  const float inverse_z = 1.0f / x.z;
  return {k.fx * x.x * inverse_z + k.cx, k.fy * x.y * inverse_z + k.cy};
}

// Whether the point is in front of the camera and inside the image.
PHI_HD bool InsideImage(const RayModel& k, Vec3f x, ImagePoint p) {
  return x.z > 0 && p.u >= 0 && p.v >= 0 && p.u < k.width && p.v < k.height;
}

}  // namespace phi
