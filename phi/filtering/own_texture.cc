#include "phi/filtering/own_texture.h"

#include <algorithm>

#include <tbb/parallel_for.h>

namespace phi {

bool HasOwnTexture(ArrayView2D<const std::uint8_t> image, int x, int y) {
  const int x0 = std::max(x - kOwnTextureRadius, 0), x1 = std::min(x + kOwnTextureRadius, image.width - 1);
  const int y0 = std::max(y - kOwnTextureRadius, 0), y1 = std::min(y + kOwnTextureRadius, image.height - 1);
  int sum = 0, squares = 0;
  for (int v = y0; v <= y1; ++v) {
    for (int u = x0; u <= x1; ++u) {
      const int value = image(u, v);
      sum += value;
      squares += value * value;
    }
  }
  const int n = (x1 - x0 + 1) * (y1 - y0 + 1);
  return n * squares - sum * sum >= kMinOwnVariance * n * n;
}

void DropPlainPixels(const GrayImage& image, PlaneMap* map) {
  tbb::parallel_for(0, map->height(), [&](int y) {
    for (int x = 0; x < map->width(); ++x) {
      PlaneHypothesis& h = (*map)(x, y);
      if (h.depth > 0 && !HasOwnTexture(image.view(), x, y)) h = {};
    }
  });
}

}  // namespace phi
