// What the even regions of a source view measured of the surfaces that the reference image's regions show: one wall is one plane,
// whichever view looks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "phi/backend.h"
#include "phi/inference/anchor_cells.h"
#include "phi/inference/line_hypothesis.h"
#include "phi/inference/region_plane.h"
#include "phi/inference/spot.h"

namespace phi {

// An image's regions, in its own camera. `label`: of each place of the image's SpotGrid, index of the region; -1: none.
struct ViewRegions {
  struct Region {
    SpotBox box;  // of its places in `label`
    std::vector<AnchorCell> cells;
    std::vector<std::int32_t> continued;  // regions that continue it: their cells count for it, too
    std::array<RegionPlane, kPlanesPerRegion> planes;
  };
  Array2D<std::int32_t> label;
  std::vector<Region> regions;
};

class SourceRegions {
 public:
  SourceRegions(std::shared_ptr<const ViewRegions> regions, const Camera& source, const Camera& reference);

  std::span<const ViewRegions::Region> regions() const { return regions_->regions; }

  // A plane in the other camera; false where it passes that camera too closely to be one of its image.
  bool ToSource(const ImagePlane& plane, ImagePlane* result) const;
  bool ToReference(const ImagePlane& plane, ImagePlane* result) const;
  // A cell in the reference image and camera; false: it lies behind the camera. Its column and row mean nothing then.
  bool ToReference(const AnchorCell& cell, AnchorCell* result) const;
  // The cells of some regions of the source and, with another weight, of those that continue them, in the reference, each once; those
  // behind its camera are left out.
  void AddCells(std::span<const std::size_t> regions, float continued_weight, std::vector<AnchorCell>* cells) const;

  // For each spot the source's region that its point on the plane falls in; -1: none.
  std::vector<std::int32_t> RegionsUnder(const ImagePlane& plane, std::span<const Spot> spots) const;

  // The region's share of the reference's spots.
  struct Overlap {
    std::int32_t region;
    double share;
  };
  // Of a region's spots, if they lie on the plane: the source's regions that many of them fall in.
  std::vector<Overlap> OverlapsUnder(const ImagePlane& plane, std::span<const Spot> spots) const;
  // Whether the source's region `index` is one of them under a plane of its own: `there` in the source, `here` in the reference.
  // `box`: of the spots. Most regions are told apart by boxes alone.
  bool Overlaps(std::size_t index, const ImagePlane& there, const ImagePlane& here, std::span<const Spot> spots,
                const SpotBox& box) const;

 private:
  void AddCellsOf(std::size_t region, float weight, std::vector<AnchorCell>* cells) const;
  bool BoxesMeet(const SpotBox& source, const ImagePlane& plane, const SpotBox& reference) const;

  std::shared_ptr<const ViewRegions> regions_;
  std::int32_t end_label_ = 0;
  SpotGrid grid_;  // of the source, as `label`'s
  RayModel source_, reference_;
  RelativeView view_;  // source from reference
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
};

}  // namespace phi
