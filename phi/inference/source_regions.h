// What the even regions of a source view measured of the surfaces that the reference image's regions show: one wall is one plane,
// whichever view looks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "phi/backend.h"
#include "phi/inference/anchor_cells.h"
#include "phi/inference/region_plane.h"
#include "phi/inference/spot.h"

namespace phi {

// An image's regions, in its own camera. `label`: of each place of the image's SpotGrid, index of the region; -1: none.
struct ViewRegions {
  struct Region {
    SpotBox box;  // of its places in `label`
    std::vector<AnchorCell> cells;
    std::vector<std::int32_t> continued;  // regions that continue it: their cells count for it, too
    PlanesOfRegion planes;       // by what the view measured itself
    std::int32_t image_region = -1;  // of the image's ImageRegions
  };
  Array2D<std::int32_t> label;
  std::vector<Region> regions;

  std::size_t bytes() const;
};

class SourceRegions {
 public:
  // choice: of the source's regions (view_choice.h); null: none is known.
  SourceRegions(std::shared_ptr<const ViewRegions> regions, const Camera& source, const Camera& reference,
                std::shared_ptr<const ViewChoice> choice = nullptr);

  std::span<const ViewRegions::Region> regions() const { return regions_->regions; }
  // The planes that a region of them chose.
  const PlanesOfRegion& ChosenBy(std::size_t region) const;

  // A plane in the other camera; false where it passes that camera too closely to be one of its image.
  bool ToSource(const ImagePlane& plane, ImagePlane* result) const;
  bool ToReference(const ImagePlane& plane, ImagePlane* result) const;
  // A cell in the reference image and camera; false: it lies behind the camera. Its column and row mean nothing then.
  bool ToReference(const AnchorCell& cell, AnchorCell* result) const;
  // function(cell, continues) for the cells of some regions of the source and of those that continue them, in the reference, each once;
  // those behind its camera are left out.
  template <typename Function>
  void ForCells(std::span<const std::size_t> regions, const Function& function) const {
    std::vector<bool> is_own(cells_.size()), continues(cells_.size());
    for (const std::size_t r : regions) {
      is_own[r] = true;
      for (const std::int32_t other : this->regions()[r].continued) continues[static_cast<std::size_t>(other)] = true;
    }
    for (std::size_t r = 0; r < cells_.size(); ++r) {
      if (is_own[r]) ForEach(cells_[r], function, false);
    }
    for (std::size_t r = 0; r < cells_.size(); ++r) {
      if (continues[r] && !is_own[r]) ForEach(cells_[r], function, true);
    }
  }

  // For each spot the source's region that its point on the plane falls in; -1: none.
  std::vector<std::int32_t> RegionsUnder(const ImagePlane& plane, std::span<const Spot> spots) const;

  // The region's share of the reference's spots.
  struct Overlap {
    std::int32_t region;
    double share;
  };
  // Of a region's spots, if they lie on the plane: the source's regions that many of them fall in.
  std::vector<Overlap> OverlapsUnder(const ImagePlane& plane, std::span<const Spot> spots) const;
  // Of a region's spots, if they lie on the plane: the share that falls in regions of the source which chose that plane there,
  // each by 1 - (off / tolerance)^2, `off` and `tolerance` relative inverse depth.
  double Agreement(const ImagePlane& plane, std::span<const Spot> spots, double tolerance) const;
  // Whether the source's region `index` is one of them under a plane of its own: `there` in the source, `here` in the reference.
  // `box`: of the spots. Most regions are told apart by boxes alone.
  bool Overlaps(std::size_t index, const ImagePlane& there, const ImagePlane& here, std::span<const Spot> spots,
                const SpotBox& box) const;

 private:
  template <typename Function>
  static void ForEach(const std::vector<AnchorCell>& cells, const Function& function, bool continues) {
    for (const AnchorCell& cell : cells) function(cell, continues);
  }
  bool BoxesMeet(const SpotBox& source, const ImagePlane& plane, const SpotBox& reference) const;

  std::shared_ptr<const ViewRegions> regions_;
  std::shared_ptr<const ViewChoice> choice_;
  std::vector<std::vector<AnchorCell>> cells_;  // of each region, in the reference: every region of it asks for them, plane by plane
  std::int32_t end_label_ = 0;
  SpotGrid grid_;  // of the source, as `label`'s
  RayModel source_, reference_;
  RelativeView view_;  // source from reference
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
};

}  // namespace phi
