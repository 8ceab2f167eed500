// Plane hypotheses from larger anchors than a scanline: an evenly coloured region of the image is likely to be one
// surface, or a few, and its measured rim carries planes that lines through six pixels only guess.
//
// Regions are connected pixels whose smoothed brightness changes slowly. Each gets up to two planes in inverse depth
// by RANSAC over its measured pixels and those of other views that land in it, refined by least squares, or takes the
// scene's where its anchors like them better. Draws are keyed by image, region and pixel: the same planes for any number
// of threads.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "phi/backend.h"
#include "phi/geometry/depth_precision.h"
#include "phi/geometry/device_camera.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/line_hypothesis.h"
#include "phi/inference/plane_choice.h"
#include "phi/inference/pooled_anchors.h"
#include "phi/inference/region_plane.h"
#include "phi/inference/scene_directions.h"
#include "phi/inference/scene_planes.h"
#include "phi/inference/source_regions.h"
#include "phi/inference/spot_views.h"

namespace phi {

// What planes rest on beside the image's own anchors.
struct PlaneEvidence {
  std::vector<PooledAnchor> pooled = {};
  std::vector<ImagePlane> scene = {};
  std::optional<SceneDirections> directions = {};
  std::optional<SpotViews> views = {};
  std::vector<SourceRegions> sources = {};
  DepthPrecision precision;  // of the image's view
  ArrayView2D<const PixelState> states = {};  // of the image's own anchors; no data: all are measured
};

// Holds references to the input's images and maps.
PlaneEvidence GatherPlaneEvidence(const InferenceInput& input, const Rules& rules);

// What a view's regions tell other views, by what the view measured itself: so each measurement counts once, however many views
// are asked.
ViewRegions FindViewRegions(std::shared_ptr<const ImageRegions> regions, const MeasuredDepths& depths,
                            std::uint32_t image_id, const DepthPrecision& precision, const Rules& rules);

// The image whose regions are found: the reference's, its mask cut out.
std::shared_ptr<const GrayImage> RegionImage(const InferenceInput& input);
// Its regions.
std::shared_ptr<const ImageRegions> RegionsOf(const InferenceInput& input, const Rules& rules);

class RegionPlanes {
 public:
  RegionPlanes(std::shared_ptr<const ImageRegions> regions, ArrayView2D<const float> anchors, std::uint32_t image_id,
               const PlaneEvidence& evidence = {}, const Rules& rules = {});

  // The planes of the pixel's region; those without anchors are 0 everywhere.
  const std::array<RegionPlane, kPlanesPerRegion>& At(int x, int y) const {
    static constexpr std::array<RegionPlane, kPlanesPerRegion> kNone{};
    const std::int32_t region = IndexAt(x, y);
    return region < 0 ? kNone : planes_[static_cast<std::size_t>(region)];
  }

  // Of ImageRegions, whether or not it has a plane.
  std::int32_t RegionAt(int x, int y) const { return regions_->region(x, y); }
  // Why the pixel's region has no plane.
  Sky SkyAt(int x, int y) const {
    const std::int32_t region = IndexAt(x, y);
    return region < 0 ? Sky::kNot : sky_[static_cast<std::size_t>(region)];
  }
  // Whether any region is the sky, or shines.
  bool ShowsSky() const;

  // Of each pixel: LineLimit bits. anchors: as the constructor's.
  Mask LineLimits(ArrayView2D<const float> anchors, const Rules& rules) const;

  // Whether an anchor of inverse depth w at (x, y) may lie so far, in inverse depth, from its plane.
  bool IsWithinTolerance(int x, int y, float w, double off) const {
    return tolerance_.Contains(static_cast<float>(x), static_cast<float>(y), w, off);
  }

  ViewRegions Tell() const;

 private:
  // Into planes_; -1: no region, or too few anchors.
  std::int32_t IndexAt(int x, int y) const {
    const std::int32_t region = regions_->region(x, y);
    return region < 0 ? -1 : index_[static_cast<std::size_t>(region)];
  }

  // By index into planes_, those that continue a region of the image.
  std::vector<std::size_t> Continued(std::int32_t region) const;

  // Of each region, by index into its planes.
  std::vector<std::vector<Spot>> SpotsWithoutAnchor(ArrayView2D<const float> anchors) const;

  AnchorTolerance tolerance_;
  std::shared_ptr<const ImageRegions> regions_;
  std::vector<std::int32_t> index_;  // of a region's planes; -1: too few anchors
  std::vector<std::array<RegionPlane, kPlanesPerRegion>> planes_;
  std::vector<Sky> sky_;                        // as planes_
  std::vector<std::uint8_t> are_mirrors_;       // as planes_
  std::vector<std::vector<AnchorCell>> cells_;  // as planes_
};

}  // namespace phi
