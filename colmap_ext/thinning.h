// Maps and masks at other sizes without blending across edges: each pixel is the nearest one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace colmap_ext {

struct ThinnedSize {
  int width = 0, height = 0;
};

// Of a map whose longer side is to be at most `longest_side` pixels. Never larger than the map.
inline ThinnedSize FittingSize(int width, int height, int longest_side) {
  const double scale = std::min(1.0, static_cast<double>(longest_side) / std::max({width, height, 1}));
  return {std::max(1, static_cast<int>(std::lround(width * scale))), std::max(1, static_cast<int>(std::lround(height * scale)))};
}

// Of an image whose side is `other` pixels, the column or row that the middle of column or row `i` of one of `side` pixels falls into.
inline int NearestPixel(int i, int side, int other) {
  return static_cast<int>((std::int64_t{2} * i + 1) * other / (std::int64_t{2} * side));
}

}  // namespace colmap_ext
