// Image pyramids and the scale of each window, for window_level.h.
#pragma once

#include <cstdint>
#include <vector>

#include <tbb/parallel_for.h>

#include "phi/base/images.h"
#include "phi/geometry/device_camera.h"
#include "phi/matching/window_level.h"

namespace phi {

// Half the size in each direction (odd sizes rounded up), 2x2 box filter. K's coordinates halve exactly.
GrayImage HalveImage(const GrayImage& image);

// Levels 1 to num_levels - 1 of `image`.
std::vector<GrayImage> BuildPyramid(const GrayImage& image, int num_levels);

// select(u, v) of each pixel's centre, K's coordinates.
template <class Select>
Array2D<WindowScale> ScalesOfPixels(int width, int height, const Select& select) {
  Array2D<WindowScale> scales(width, height);
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) scales(x, y) = select(x + 0.5f, y + 0.5f);
  });
  return scales;
}

// Windows should be small beside the image; pixels of a level's shorter side.
inline constexpr int kMinLevelSide = 96;

// The levels of an image of that size whose shorter side has at least min_side pixels: 1 at least, `most` at most.
int NumLevels(const Pinhole& size, int min_side, int most);

// The scale of each pixel's window (see window_level.h). `coarser`: BuildPyramid(image, ...).
Array2D<WindowScale> SelectWindowScales(const GrayImage& image, const std::vector<GrayImage>& coarser,
                                        const MatchingWindow& window);

// The view between images that are both reduced by `scale`.
RelativeView ScaleView(RelativeView view, float scale);

}  // namespace phi
