// Plane hypotheses from larger anchors than a scanline: an evenly coloured region of the image is likely to be one
// surface, or a few, and its measured rim carries planes that lines through six pixels only guess.
//
// Regions are connected pixels whose smoothed brightness changes slowly; region_fit.h finds their planes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "phi/backend.h"
#include "phi/geometry/depth_precision.h"
#include "phi/geometry/device_camera.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/line_hypothesis.h"
#include "phi/inference/plane_evidence.h"
#include "phi/inference/region_fit.h"
#include "phi/inference/region_plane.h"
#include "phi/inference/source_regions.h"

namespace phi {

// What a view's regions tell other views, by what the view measured itself: so each measurement counts once, however many views
// are asked.
ViewRegions FindViewRegions(std::shared_ptr<const ImageRegions> regions, const MeasuredDepths& depths,
                            std::uint32_t image_id, const DepthPrecision& precision, const Rules& rules);

// Those of the reference's image, its mask cut out.
std::shared_ptr<const ImageRegions> RegionsOf(const InferenceInput& input, const Rules& rules);

class RegionPlanes {
 public:
  RegionPlanes(std::shared_ptr<const ImageRegions> regions, ArrayView2D<const float> anchors, std::uint32_t image_id,
               const PlaneEvidence& evidence = {}, const Rules& rules = {});
  RegionPlanes(std::shared_ptr<const ImageRegions> regions, const AnchorTolerance& tolerance, FittedRegions fitted)
      : tolerance_(tolerance), regions_(std::move(regions)), fitted_(std::move(fitted)) {}

  // The planes of the pixel's region; those without anchors are 0 everywhere.
  const PlanesOfRegion& At(int x, int y) const {
    static constexpr PlanesOfRegion kNone{};
    const FittedRegion* region = Fitted(RegionAt(x, y));
    return region == nullptr ? kNone : region->planes;
  }

  // function(begin, end, region) for the runs of pixels of row y that share a region with anchors enough: a FittedRegion.
  template <typename Function>
  void ForFittedRuns(int y, const Function& function) const {
    ForRunsOfRow(*regions_, y, [&](std::int32_t region, int begin, int end) {
      if (const FittedRegion* fitted = Fitted(region)) function(begin, end, *fitted);
    });
  }

  // Of ImageRegions, whether or not it has a plane.
  std::int32_t RegionAt(int x, int y) const { return regions_->region(x, y); }
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
  // Into fitted_.regions; -1: no region, or too few anchors.
  std::int32_t IndexOf(std::int32_t region) const { return region < 0 ? -1 : fitted_.index[static_cast<std::size_t>(region)]; }
  // Null: the same.
  const FittedRegion* Fitted(std::int32_t region) const {
    const std::int32_t k = IndexOf(region);
    return k < 0 ? nullptr : &fitted_.regions[static_cast<std::size_t>(k)];
  }

  AnchorTolerance tolerance_;
  std::shared_ptr<const ImageRegions> regions_;
  FittedRegions fitted_;
};

// Of the input's reference: what its regions choose, again if the input has a first choice. anchors: AnchorMap of its measured map.
RegionPlanes FindRegionPlanes(const InferenceInput& input, std::shared_ptr<const ImageRegions> regions,
                              ArrayView2D<const float> anchors, const Rules& rules);

}  // namespace phi
