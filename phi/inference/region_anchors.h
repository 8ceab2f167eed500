// The anchors that the planes of an image's regions rest on: its own measured pixels, and those of other views that land in them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "phi/base/array2d.h"
#include "phi/inference/anchor_cells.h"
#include "phi/inference/image_regions.h"
#include "phi/inference/pooled_anchors.h"
#include "phi/measurement.h"

namespace phi {

// In the reference image and camera: array indices, inverse depth.
struct RegionPoint {
  float x, y, w;
  float tolerance;     // of w
  std::uint32_t hash;  // of the anchor: uniform
  bool is_measured;    // a clue otherwise
};

// Of the regions that have at least `min_anchors`. Large ones have a sample, drawn by pixel: the same for any number of threads,
// and one anchor more or less leaves the others as they are.
class RegionAnchors {
 public:
  // Keeps references to anchors, pooled and states. anchors: inverse depth of the image's own, 0: none. states: of the same pixels; no
  // data: all anchors are measured.
  RegionAnchors(const ImageRegions& regions, ArrayView2D<const float> anchors, std::span<const PooledAnchor> pooled,
                int min_anchors, ArrayView2D<const PixelState> states = {});

  std::size_t size() const { return regions_.size(); }
  std::int32_t region(std::size_t k) const { return regions_[k].region; }
  // Whether at most half of its pixels have an anchor of the image's own.
  bool IsOpen(std::size_t k) const { return regions_[k].is_open; }
  // Of each region of the image, which k it is; -1: none.
  const std::vector<std::int32_t>& index() const { return index_; }

  // Of region(k), by ascending hash.
  std::vector<RegionPoint> Points(std::size_t k, const AnchorTolerance& tolerance) const;

 private:
  // An anchor of a region: a pixel's index, or ~k for the pooled anchor k.
  using Member = std::int32_t;

  // Which of the members are a region's own.
  struct Region {
    std::int32_t region;
    std::uint32_t max_hash;  // of the anchors that become members
    std::int64_t begin;
    bool is_open;
    std::int32_t num_members = 0;
  };

  void ListMembers(const ImageRegions& regions);
  void Append(std::span<const Member> members, Region* region);
  RegionPoint PointOf(Member member) const;

  ArrayView2D<const float> anchors_;
  std::span<const PooledAnchor> pooled_;
  ArrayView2D<const PixelState> states_;
  std::vector<Region> regions_;
  std::vector<std::int32_t> index_;
  std::unique_ptr<Member[]> members_;
};

}  // namespace phi
