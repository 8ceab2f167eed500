#include "phi/inference/source_regions.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "phi/base/wide_vectors.h"
#include "phi/geometry/camera.h"
#include "phi/inference/camera_plane.h"
#include "phi/inference/shown_point.h"
#include "phi/inference/view_choice.h"

namespace phi {
namespace {

// Of a region's spots in another view's region: fewer are where the two meet.
constexpr double kMinOverlap = 0.2;
// Of a plane's inverse depth at the one camera's centre over the other's: nearer to 0 it passes the camera.
constexpr double kMinClearance = 0.05;

Eigen::Vector3d Times(const Mat3f& m, Vec3f v) {
  const Vec3f p = m * v;
  return {p.x, p.y, p.z};
}

// For each spot the place of the source's grid, row by row, that its point on the plane falls in; -1: none. By value what is
// read in the loop, so that the compiler sees that `places` changes none of it.
PHI_WIDE_VECTORS void FindPlaces(const ImagePlane plane, const RelativeView view, const SpotGrid grid,
                                 std::span<const Spot> spots, std::int32_t* __restrict places) {
  const auto width = static_cast<float>(view.source.width), height = static_cast<float>(view.source.height);
  const float inverse_step = 1.0f / static_cast<float>(grid.step);
  const Spot* __restrict const spot = spots.data();
  const auto num_spots = static_cast<std::ptrdiff_t>(spots.size());
  for (std::ptrdiff_t i = 0; i < num_spots; ++i) {
    const auto w = static_cast<float>(plane.InverseDepth(spot[i].x, spot[i].y));
    const float x = static_cast<float>(spot[i].x) + 0.5f, y = static_cast<float>(spot[i].y) + 0.5f;
    const Vec3f p = ProjectInverseDepth(view, x, y, w);
    const float u = p.x / p.z, v = p.y / p.z;
    const std::int32_t is_seen = (w > 0) & (p.z > 0) & (u >= 0) & (v >= 0) & (u < width) & (v < height);
    // Of the pixel's middle, so that no rounding takes it to the place before.
    const auto pixel_u = static_cast<std::int32_t>(std::min(std::max(0.0f, u), width)),
               pixel_v = static_cast<std::int32_t>(std::min(std::max(0.0f, v), height));
    const auto column = static_cast<std::int32_t>((static_cast<float>(pixel_u) + 0.5f) * inverse_step),
               row = static_cast<std::int32_t>((static_cast<float>(pixel_v) + 0.5f) * inverse_step);
    places[i] = (row * grid.columns + column) | (is_seen - 1);
  }
}

}  // namespace

std::size_t ViewRegions::bytes() const {
  std::size_t bytes = sizeof(*this) + label.bytes() + regions.size() * sizeof(Region);
  for (const Region& region : regions) bytes += region.cells.size() * sizeof(AnchorCell);
  return bytes;
}

SourceRegions::SourceRegions(std::shared_ptr<const ViewRegions> regions, const Camera& source, const Camera& reference,
                             std::shared_ptr<const ViewChoice> choice)
    : regions_(std::move(regions)),
      choice_(std::move(choice)),
      grid_(source.pinhole.width, source.pinhole.height),
      source_(MakeRayModel(source.pinhole)),
      reference_(MakeRayModel(reference.pinhole)),
      view_(MakeRelativeView(reference, source)),
      translation_(view_.translation.x, view_.translation.y, view_.translation.z) {
  rotation_ << Times(view_.rotation, {1, 0, 0}), Times(view_.rotation, {0, 1, 0}),
      Times(view_.rotation, {0, 0, 1});
  for (const std::int32_t label : regions_->label) end_label_ = std::max(end_label_, label + 1);
  for (const ViewRegions::Region& region : regions_->regions) {
    std::vector<AnchorCell>& here = cells_.emplace_back();
    here.reserve(region.cells.size());
    for (const AnchorCell& cell : region.cells) {
      if (AnchorCell moved; ToReference(cell, &moved)) here.push_back(moved);
    }
  }
}

const PlanesOfRegion& SourceRegions::ChosenBy(std::size_t region) const {
  static constexpr PlanesOfRegion kNone{};
  return choice_ == nullptr ? kNone : choice_->PlanesOf(regions()[region].image_region);
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
  const Eigen::Vector3d point = rotation_.transpose() * (RayOf(cell.x, cell.y, source_) / cell.w - translation_);
  if (!(point.z() > 0)) return false;
  *result = cell;
  result->x = static_cast<float>(reference_.fx * point.x() / point.z() + reference_.cx - 0.5);
  result->y = static_cast<float>(reference_.fy * point.y() / point.z() + reference_.cy - 0.5);
  result->w = 1 / point.z();
  result->tolerance *= result->w / cell.w;
  return true;
}

std::vector<std::int32_t> SourceRegions::RegionsUnder(const ImagePlane& plane, std::span<const Spot> spots) const {
  std::vector<std::int32_t> regions(spots.size());
  const Array2D<std::int32_t>& label = regions_->label;
  FindPlaces(plane, view_, grid_, spots, regions.data());
  for (std::int32_t& region : regions) {
    if (region >= 0) region = label.data()[region];
  }
  return regions;
}

std::vector<SourceRegions::Overlap> SourceRegions::OverlapsUnder(const ImagePlane& plane,
                                                                 std::span<const Spot> spots) const {
  std::vector<int> counts(static_cast<std::size_t>(end_label_), 0);
  for (const std::int32_t region : RegionsUnder(plane, spots)) {
    if (region >= 0) ++counts[static_cast<std::size_t>(region)];
  }
  std::vector<Overlap> overlaps;
  for (std::int32_t region = 0; region < end_label_; ++region) {
    const int count = counts[static_cast<std::size_t>(region)];
    if (count == 0) continue;  // most of them
    const double share = count / static_cast<double>(spots.size());
    if (share >= kMinOverlap) overlaps.push_back({region, share});
  }
  return overlaps;
}

double SourceRegions::Agreement(const ImagePlane& plane, std::span<const Spot> spots, double tolerance) const {
  ImagePlane there;
  if (choice_ == nullptr || !ToSource(plane, &there)) return 0;
  std::vector<std::int32_t> places(spots.size());
  FindPlaces(plane, view_, grid_, spots, places.data());
  double sum = 0;
  for (const std::int32_t place : places) {
    const std::int32_t region = place < 0 ? -1 : regions_->label.data()[place];
    if (region < 0) continue;
    const Spot spot = grid_.At(place % grid_.columns, place / grid_.columns);
    const double w = there.InverseDepth(spot.x, spot.y);
    double best = 0;
    for (const RegionPlane& chosen : ChosenBy(static_cast<std::size_t>(region))) {
      const double off = (chosen.At(spot.x, spot.y) / w - 1) / tolerance;  // where the plane has no depth, -1 / tolerance
      best = std::max(best, 1 - off * off);
    }
    sum += best;
  }
  return sum / static_cast<double>(spots.size());
}

bool SourceRegions::Overlaps(std::size_t index, const ImagePlane& there, const ImagePlane& here,
                             std::span<const Spot> spots, const SpotBox& box) const {
  if (!BoxesMeet(regions()[index].box, there, box)) return false;
  const std::vector<std::int32_t> regions = RegionsUnder(here, spots);
  const auto num_inside = std::count(regions.begin(), regions.end(), static_cast<std::int32_t>(index));
  return static_cast<double>(num_inside) / static_cast<double>(spots.size()) >= kMinOverlap;
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
