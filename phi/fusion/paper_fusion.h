// The paper's fusion (section F): the images are taken one after the other. Each pixel that is left gives a point, the plain
// average of its own and those of all images to come whose point, at the pixel that it falls on, is nearer than
// max_depth_error; these pixels are taken away. The paper divides the distance by nothing that it names; depth does not
// depend on where the world's origin lies.
//
// The reference's pixels come in raster order: a pixel that two of them would take in belongs to the first.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/fusion/image_fusion.h"

namespace phi {

class PaperFuser {
 public:
  using Image = ImageFuser::Image;

  // `to_come`: the images that were not the reference yet. Does the comparisons, with all threads, and marks what the
  // reference takes in from their maps (kMerged). `box` may be null. The maps must outlive the fuser.
  PaperFuser(const Image& reference, const std::vector<Image>& to_come, const FusionOptions& options,
             const BoundingBox* box);

  // Rows [begin, end). Safe to call concurrently for disjoint ranges.
  FusedBlock FuseRows(int begin, int end) const;

 private:
  struct Other {
    std::uint32_t index = 0;  // of the image in the model
    RelativeView view;
    FusionMap* map = nullptr;
  };
  // Where a reference pixel's point falls in another image: an element of its map, -1 = nowhere.
  std::int64_t Find(const Other& other, Vec3f point) const;
  // The point of that pixel, in the reference frame.
  Vec3f PointOf(const Other& other, std::int64_t pixel) const;
  // Of the pixel that `point` falls on: -1 also where it is gone or has another point.
  std::int64_t FindAgreeing(const Other& other, Vec3f point) const;
  // The reference pixels take in what agrees of others_[k]. `claims`: room for an element for each of its pixels.
  void TakeIn(std::size_t k, std::vector<std::uint32_t>* claims);
  PixelOutcome FusePixel(int x, int y, FusedBlock* block) const;

  template <class Function>
  void ForEachPixelLeft(const Function& function) const;
  Vec3f ReferencePoint(int x, int y) const;

  Image reference_;
  RayModel rays_;
  std::vector<Other> others_;
  float max_depth_error_;
  int min_num_views_, max_num_views_;
  const BoundingBox* box_;
  std::size_t num_words_;                // of taken_in_ for each pixel
  std::vector<std::uint64_t> taken_in_;  // bit k of a pixel's words: it took in one of others_[k]
  std::vector<std::uint16_t> counts_;    // of those bits
};

}  // namespace phi
