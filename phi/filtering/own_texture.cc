#include "phi/filtering/own_texture.h"

#include <algorithm>
#include <cstdint>

#include <tbb/parallel_for.h>

#include "phi/base/box_sums.h"
#include "phi/base/image_noise.h"

namespace phi {
namespace {

constexpr int kSumsPerGreyLevel = 9;  // of the smoothed image

// `min_variance`: of the sums.
bool HasOwnTexture(const Array2D<std::uint16_t>& sums, double min_variance, int x, int y) {
  const int x0 = std::max(x - kOwnTextureRadius, 0), x1 = std::min(x + kOwnTextureRadius, sums.width() - 1);
  const int y0 = std::max(y - kOwnTextureRadius, 0), y1 = std::min(y + kOwnTextureRadius, sums.height() - 1);
  std::int64_t sum = 0, squares = 0;
  for (int v = y0; v <= y1; ++v) {
    for (int u = x0; u <= x1; ++u) {
      const std::int64_t value = sums(u, v);
      sum += value;
      squares += value * value;
    }
  }
  const std::int64_t n = static_cast<std::int64_t>(x1 - x0 + 1) * (y1 - y0 + 1);
  return static_cast<double>(n * squares - sum * sum) >= min_variance * static_cast<double>(n * n);
}

}  // namespace

void DropPlainPixels(const GrayImage& image, PlaneMap* map) {
  const Array2D<std::uint16_t> sums = SumBoxes3x3(image.view());
  const double noise = NoiseDeviation(image.view());
  const double min_variance = kSumsPerGreyLevel * kSumsPerGreyLevel *
                              std::max(kMinOwnVariance, kMinOwnVarianceOverNoise / 9 * noise * noise);
  tbb::parallel_for(0, map->height(), [&](int y) {
    for (int x = 0; x < map->width(); ++x) {
      PlaneHypothesis& h = (*map)(x, y);
      if (h.depth > 0 && !HasOwnTexture(sums, min_variance, x, y)) h = {};
    }
  });
}

}  // namespace phi
