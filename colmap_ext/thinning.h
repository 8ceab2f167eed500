// Maps thinned to a picture's size without blending across edges: each of its pixels is the map's nearest one.
#pragma once

#include <algorithm>
#include <cmath>

namespace colmap_ext {

struct ThinnedSize {
  int width = 0, height = 0;
};

// Of a map whose longer side is to be at most `longest_side` pixels. Never larger than the map.
inline ThinnedSize FittingSize(int width, int height, int longest_side) {
  const double scale = std::min(1.0, static_cast<double>(longest_side) / std::max({width, height, 1}));
  return {std::max(1, static_cast<int>(std::lround(width * scale))), std::max(1, static_cast<int>(std::lround(height * scale)))};
}

// The column (or row) of `full` that is nearest to column i of `thinned`.
inline int NearestColumn(int i, int thinned, int full) { return static_cast<int>((i + 0.5) * full / thinned); }

}  // namespace colmap_ext
