#include "colmap_ext/pinhole_camera.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "colmap_ext/format_text.h"

namespace colmap_ext {
namespace {

// Camera models whose parameters are those of a pinhole, f or fx and fy, cx, cy, and distortion after them. A fisheye without
// distortion is no pinhole.
struct PinholeModel {
  int model_id, num_focal_lengths;
};
constexpr PinholeModel kPinholeModels[] = {{0, 1},   // SIMPLE_PINHOLE
                                           {1, 2},   // PINHOLE
                                           {2, 1},   // SIMPLE_RADIAL
                                           {3, 1},   // RADIAL
                                           {4, 2},   // OPENCV
                                           {6, 2}};  // FULL_OPENCV
constexpr double kNoDistortion = 1e-8;  // as COLMAP, which then copies the photo and keeps the camera

// Tangents from the axis: no lens that is a pinhole sees beyond 89.4 degrees, and no telescope an image within a fifth of a second.
constexpr double kSteepestRay = 100, kNarrowestView = 1e-6;

// Of one axis, all in pixels.
bool IsPossible(double size, double focal_length, double principal_point) {
  const double first = -principal_point / focal_length, last = (size - principal_point) / focal_length;
  return std::max(std::abs(first), std::abs(last)) <= kSteepestRay && size / focal_length >= kNarrowestView;
}

// 1: f; 2: fx and fy; 0: the camera is no pinhole.
int NumFocalLengths(const SparseCamera& camera) {
  for (const auto& [model_id, num_focal_lengths] : kPinholeModels) {
    if (camera.model_id != model_id) continue;
    const auto is_none = [](double parameter) { return std::abs(parameter) <= kNoDistortion; };
    return std::all_of(camera.params.begin() + num_focal_lengths + 2, camera.params.end(), is_none) ? num_focal_lengths : 0;
  }
  return 0;
}

}  // namespace

std::string PinholeProblem(const SparseCamera& camera) {
  const std::string who = "camera " + std::to_string(camera.camera_id);
  const int num_focal_lengths = NumFocalLengths(camera);
  if (num_focal_lengths == 0) {
    return who + " is " + CameraModelName(camera.model_id) +
           ", but dense stereo needs SIMPLE_PINHOLE or PINHOLE; run colmap image_undistorter";
  }
  const double fx = camera.params[0], fy = camera.params[num_focal_lengths - 1];
  if (!(fx > 0) || !(fy > 0)) return who + " has a focal length that is not positive; correct it, or calibrate the camera again";
  const double cx = camera.params[num_focal_lengths], cy = camera.params[num_focal_lengths + 1];
  if (!IsPossible(static_cast<double>(camera.width), fx, cx) || !IsPossible(static_cast<double>(camera.height), fy, cy)) {
    return who + FormatText(" has an impossible focal length or principal point for its image of %s pixels: f %.6g, %.6g, c %.6g, %.6g; "
                            "correct them, or calibrate the camera again",
                            SizeText(camera.width, camera.height).c_str(), fx, fy, cx, cy);
  }
  return "";
}

phi::Pinhole MakePinhole(const SparseCamera& camera) {
  const int num_focal_lengths = NumFocalLengths(camera);
  const std::vector<double>& p = camera.params;
  return {static_cast<int>(camera.width),
          static_cast<int>(camera.height),
          p[0],
          p[num_focal_lengths - 1],
          p[num_focal_lengths],
          p[num_focal_lengths + 1]};
}

phi::Pinhole DownsizedPinhole(const phi::Pinhole& full, int max_image_size) {
  if (max_image_size <= 0 || std::max(full.width, full.height) <= max_image_size) return full;
  // Single precision, because COLMAP rounds the size so.
  const float factor = std::min(static_cast<float>(max_image_size) / static_cast<float>(full.width),
                                static_cast<float>(max_image_size) / static_cast<float>(full.height));
  phi::Pinhole small;
  small.width = std::max(1, static_cast<int>(std::round(static_cast<float>(full.width) * factor)));
  small.height = std::max(1, static_cast<int>(std::round(static_cast<float>(full.height) * factor)));
  const double scale_x = static_cast<double>(small.width) / full.width;
  const double scale_y = static_cast<double>(small.height) / full.height;
  small.fx = full.fx * scale_x;
  small.cx = full.cx * scale_x;
  small.fy = full.fy * scale_y;
  small.cy = full.cy * scale_y;
  return small;
}

}  // namespace colmap_ext
