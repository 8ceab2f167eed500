// The anchors that drawn planes are scored on, a value after the other: loops over them become vector instructions.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "phi/inference/image_plane.h"

namespace phi {

class ScoredAnchors {
 public:
  // Every `stride`th of the anchors.
  template <typename Anchor>
  explicit ScoredAnchors(std::span<const Anchor> anchors, std::size_t stride = 1) {
    const std::size_t size = (anchors.size() + stride - 1) / stride;
    x_.reserve(size), y_.reserve(size), w_.reserve(size), tolerance_.reserve(size);
    for (std::size_t i = 0; i < anchors.size(); i += stride) {
      x_.push_back(anchors[i].x), y_.push_back(anchors[i].y);
      w_.push_back(anchors[i].w), tolerance_.push_back(anchors[i].tolerance);
    }
  }

  std::size_t size() const { return x_.size(); }

  // Those on the plane; stops where they cannot be more than `needed`.
  std::size_t CountInliers(const ImagePlane& plane, std::size_t needed) const;

 private:
  std::vector<float> x_, y_;
  std::vector<double> w_, tolerance_;
};

}  // namespace phi
