// The best pixel of each sector (propagation.h) for all pixels of one colour of a row at once: a loop along the row for each sample of
// a sector is vector instructions, where a pixel by itself is a search with a branch for each.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/base/array2d.h"
#include "phi/matching/propagation.h"

namespace phi {

class SectorBests {
 public:
  // Of the pixels first_x, first_x + 2, ... of row y; reads pixels of the other colour alone. What it finds holds until a cost of
  // theirs changes.
  void Find(ArrayView2D<const float> cost, int first_x, int y);

  // As propagation.h's.
  bool BestInSector(int x, int sector, PixelOffset* best) const {
    const std::int32_t sample = samples_[static_cast<std::size_t>(sector) * num_pixels_ + static_cast<std::size_t>(x / 2)];
    if (sample < 0) return false;
    *best = SectorOffset(sector, sample);
    return true;
  }

 private:
  std::size_t num_pixels_ = 0;
  std::vector<float> lowest_;          // of one sector
  std::vector<std::int32_t> samples_;  // for each sector in turn, of each pixel the best sample's number; -1: it lies outside
};

}  // namespace phi
