#include "phi/inference/source_regions.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "phi/geometry/camera.h"
#include "phi/inference/confirmation.h"

namespace phi {
namespace {

// Of a region's spots in another view's region: fewer are where the two meet.
constexpr double kMinOverlap = 0.2;
// Of a plane's inverse depth at the one camera's centre over the other's: nearer to 0 it passes the camera.
constexpr double kMinClearance = 0.05;

// n with n . X = 1 for the points X of the plane in the camera's frame.
Eigen::Vector3d NormalOf(const ImagePlane& p, const RayModel& camera) {
  return {p.b * camera.fx, p.c * camera.fy, p.a + p.b * (camera.cx - 0.5) + p.c * (camera.cy - 0.5)};
}

ImagePlane PlaneOf(const Eigen::Vector3d& n, const RayModel& camera) {
  const double b = n.x() / camera.fx, c = n.y() / camera.fy;
  return {n.z() - b * (camera.cx - 0.5) - c * (camera.cy - 0.5), b, c};
}

Eigen::Vector3d Times(const Mat3f& m, Vec3f v) {
  const Vec3f p = m * v;
  return {p.x, p.y, p.z};
}

}  // namespace

SourceRegions::SourceRegions(std::shared_ptr<const ViewRegions> regions, const Camera& source,
                             const Camera& reference)
    : regions_(std::move(regions)),
      step_(SpotGrid(source.pinhole.width, source.pinhole.height).step),
      source_(MakeRayModel(source.pinhole)),
      reference_(MakeRayModel(reference.pinhole)),
      view_(MakeRelativeView(reference, source)),
      translation_(view_.translation.x, view_.translation.y, view_.translation.z) {
  rotation_ << Times(view_.rotation, {1, 0, 0}), Times(view_.rotation, {0, 1, 0}),
      Times(view_.rotation, {0, 0, 1});
}

bool SourceRegions::ToSource(const ImagePlane& plane, ImagePlane* result) const {
  const Eigen::Vector3d n = rotation_ * NormalOf(plane, reference_);
  const double clearance = 1 + n.dot(translation_);
  if (!(clearance > kMinClearance)) return false;
  *result = PlaneOf(n / clearance, source_);
  return true;
}

bool SourceRegions::ToReference(const ImagePlane& plane, ImagePlane* result) const {
  const Eigen::Vector3d n = NormalOf(plane, source_);
  const double clearance = 1 - n.dot(translation_);
  if (!(clearance > kMinClearance)) return false;
  *result = PlaneOf(rotation_.transpose() * n / clearance, reference_);
  return true;
}

bool SourceRegions::ToReference(const AnchorCell& cell, AnchorCell* result) const {
  const Eigen::Vector3d ray((cell.x + 0.5 - source_.cx) / source_.fx,
                            (cell.y + 0.5 - source_.cy) / source_.fy, 1);
  const Eigen::Vector3d point = rotation_.transpose() * (ray / cell.w - translation_);
  if (!(point.z() > 0)) return false;
  *result = cell;
  result->x = static_cast<float>(reference_.fx * point.x() / point.z() + reference_.cx - 0.5);
  result->y = static_cast<float>(reference_.fy * point.y() / point.z() + reference_.cy - 0.5);
  result->w = 1 / point.z();
  result->tolerance *= result->w / cell.w;
  return true;
}

std::int32_t SourceRegions::RegionUnder(const ImagePlane& plane, const Spot& spot) const {
  const double w = plane.InverseDepth(spot.x, spot.y);
  if (!(w > 0)) return -1;
  const Vec3f p = ProjectInverseDepth(view_, static_cast<float>(spot.x) + 0.5f,
                                      static_cast<float>(spot.y) + 0.5f, static_cast<float>(w));
  if (!(p.z > 0)) return -1;
  const float u = p.x / p.z, v = p.y / p.z;
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(source_.width) && v < static_cast<float>(source_.height)))
    return -1;
  return regions_->label(static_cast<int>(u) / step_, static_cast<int>(v) / step_);
}

std::vector<SourceRegions::Overlap> SourceRegions::OverlapsUnder(const ImagePlane& plane,
                                                                 std::span<const Spot> spots) const {
  std::vector<std::int32_t> labels;
  for (const Spot& spot : spots) {
    if (const std::int32_t region = RegionUnder(plane, spot); region >= 0) labels.push_back(region);
  }
  std::sort(labels.begin(), labels.end());
  std::vector<Overlap> overlaps;
  for (std::size_t begin = 0, end = 0; begin < labels.size(); begin = end) {
    while (end < labels.size() && labels[end] == labels[begin]) ++end;
    const double share = static_cast<double>(end - begin) / static_cast<double>(spots.size());
    if (share >= kMinOverlap) overlaps.push_back({labels[begin], share});
  }
  return overlaps;
}

bool SourceRegions::Overlaps(std::size_t index, const ImagePlane& there, const ImagePlane& here,
                             std::span<const Spot> spots, const SpotBox& box) const {
  if (!BoxesMeet(regions()[index].box, there, box)) return false;
  std::size_t num_inside = 0;
  for (std::size_t i = 0; i < spots.size(); ++i) {
    num_inside += RegionUnder(here, spots[i]) == static_cast<std::int32_t>(index);
    if (static_cast<double>(num_inside) / static_cast<double>(spots.size()) >= kMinOverlap) return true;
  }
  return false;
}

// Whether the source's box, put on its plane, may be seen within the reference's. Seen from the reference it is the quadrangle
// of its corners, as long as the plane is before both cameras at all of them.
bool SourceRegions::BoxesMeet(const SpotBox& source, const ImagePlane& plane, const SpotBox& reference) const {
  if (source.IsEmpty()) return false;
  SpotBox seen;
  for (const float x : {source.left, source.right}) {
    for (const float y : {source.top, source.bottom}) {
      const double w = plane.InverseDepth(x, y);
      AnchorCell corner;
      if (!(w > 0) || !ToReference({x, y, w, 0, 0, 0}, &corner)) return true;
      seen.Add(corner.x, corner.y);
    }
  }
  return seen.Meets(reference);
}

}  // namespace phi
