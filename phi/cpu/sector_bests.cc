#include "phi/cpu/sector_bests.h"

#include <algorithm>
#include <limits>

#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

// `cost`: of the sample for the first pixel, and two elements on for each next one.
PHI_WIDE_VECTORS void TakeLower(const float* cost, int num_pixels, std::int32_t sample, float* lowest, std::int32_t* best) {
  for (int i = 0; i < num_pixels; ++i) {
    const float own = cost[2 * i];
    best[i] = own < lowest[i] ? sample : best[i];
    lowest[i] = own < lowest[i] ? own : lowest[i];
  }
}

}  // namespace

void SectorBests::Find(ArrayView2D<const float> cost, int first_x, int y) {
  const int num_pixels = (cost.width - first_x + 1) / 2;
  num_pixels_ = static_cast<std::size_t>(num_pixels);
  lowest_.resize(num_pixels_);
  samples_.assign(kNumSectors * num_pixels_, -1);
  for (int sector = 0; sector < kNumSectors; ++sector) {
    std::int32_t* best = samples_.data() + static_cast<std::size_t>(sector) * num_pixels_;
    std::fill(lowest_.begin(), lowest_.end(), std::numeric_limits<float>::infinity());
    for (int sample = 0; sample < NumSectorSamples(sector); ++sample) {
      const PixelOffset o = SectorOffset(sector, sample);
      if (y + o.dy < 0 || y + o.dy >= cost.height) continue;
      // Of the pixels whose sample lies in the image.
      const int left = first_x + o.dx;
      const int begin = left < 0 ? (1 - left) / 2 : 0;
      const int end = std::min(num_pixels, (cost.width - left + 1) / 2);
      if (begin >= end) continue;
      TakeLower(&cost(left + 2 * begin, y + o.dy), end - begin, sample, lowest_.data() + begin, best + begin);
    }
  }
}

}  // namespace phi
