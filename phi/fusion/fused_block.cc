#include "phi/fusion/fused_block.h"

#include <algorithm>

namespace phi {
namespace {

bool Contains(const BoundingBox& box, const Eigen::Vector3d& world) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!(world[axis] >= box.min[axis] && world[axis] <= box.max[axis])) return false;
  }
  return true;
}

}  // namespace

PixelOutcome EmitPoint(const Pose& pose, const BoundingBox* box, const PointCandidate& candidate,
                       FusedBlock* block) {
  const auto to_double = [](Vec3f v) { return Eigen::Vector3d(v.x, v.y, v.z); };
  const Eigen::Vector3d world = pose.rotation.transpose() * (to_double(candidate.point) - pose.translation);
  const Eigen::Vector3d normal = pose.rotation.transpose() * to_double(candidate.normal).normalized();
  const auto first_view = block->views.end() - candidate.num_views;
  if (box != nullptr && !Contains(*box, world)) {
    block->views.erase(first_view, block->views.end());
    return PixelOutcome::kOutsideBox;
  }
  std::sort(first_view, block->views.end());
  FusedPoint& point = block->points.emplace_back();
  for (int axis = 0; axis < 3; ++axis) {
    point.xyz[axis] = world[axis];
    point.normal[axis] = static_cast<float>(normal[axis]);
    const int sum = candidate.rgb_sum[axis];
    point.rgb[axis] = static_cast<std::uint8_t>((sum + candidate.num_views / 2) / candidate.num_views);
  }
  point.inferred = 2 * candidate.num_inferred > candidate.num_views ? 1 : 0;
  point.confidence = static_cast<std::uint8_t>(candidate.confidence) & 0x7f;
  block->view_counts.push_back(static_cast<std::uint32_t>(candidate.num_views));
  return PixelOutcome::kFused;
}

}  // namespace phi
