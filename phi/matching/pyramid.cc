#include "phi/matching/pyramid.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "phi/geometry/camera.h"

namespace phi {

GrayImage HalveImage(const GrayImage& image) {
  GrayImage half((image.width() + 1) / 2, (image.height() + 1) / 2);
  tbb::parallel_for(0, half.height(), [&](int y) {
    const int y0 = 2 * y, y1 = std::min(2 * y + 1, image.height() - 1);
    for (int x = 0; x < half.width(); ++x) {
      const int x0 = 2 * x, x1 = std::min(2 * x + 1, image.width() - 1);
      half(x, y) =
          static_cast<std::uint8_t>((image(x0, y0) + image(x1, y0) + image(x0, y1) + image(x1, y1) + 2) / 4);
    }
  });
  return half;
}

std::vector<GrayImage> BuildPyramid(const GrayImage& image, int num_levels) {
  std::vector<GrayImage> levels;
  for (int level = 1; level < num_levels; ++level) {
    levels.push_back(HalveImage(level == 1 ? image : levels.back()));
  }
  return levels;
}

int NumLevels(const Pinhole& size, int min_side, int most) {
  int num_levels = 1;
  while (num_levels < most && (std::min(size.width, size.height) >> num_levels) >= min_side) ++num_levels;
  return num_levels;
}

Array2D<WindowScale> SelectWindowScales(const GrayImage& image, const std::vector<GrayImage>& coarser,
                                        const MatchingWindow& window) {
  std::vector<GraySampler> samplers = {{image.view()}};
  for (const GrayImage& level : coarser) samplers.push_back({level.view()});
  const int num_levels = static_cast<int>(samplers.size());
  return ScalesOfPixels(image.width(), image.height(), [&](float u, float v) {
    return SelectWindowScale(samplers.data(), num_levels, window, u, v);
  });
}

RelativeView ScaleView(RelativeView view, float scale) {
  view.a = ScaleHomography(view.a, scale);
  view.b.x *= scale;
  view.b.y *= scale;
  return view;
}

}  // namespace phi
