#include "phi/cpu/simd_window.h"

namespace phi {

SimdWindow::SimdWindow(const MatchingWindow& window) : radius(window.Radius()) {
  const int n = window.samples_per_side;
  const auto is_sparse = [n](int offset) {
    for (int i = 0; i < kSparseSide; ++i) {
      if (SparseOffset(i, n) == offset) return true;
    }
    return false;
  };
  const auto add = [&](bool sparse) {
    for (int row = -n; row <= n; ++row) {
      for (int column = -n; column <= n; ++column) {
        const bool is_centre = row == 0 && column == 0;
        if (is_centre || (is_sparse(row) && is_sparse(column)) != sparse) continue;
        dx.push_back(static_cast<float>(column) * window.step);
        dy.push_back(static_cast<float>(row) * window.step);
        ++num_samples;
      }
    }
    const std::size_t padded = (dx.size() + kSimdChunk - 1) / kSimdChunk * kSimdChunk;
    dx.resize(padded, 0.0f);
    dy.resize(padded, 0.0f);
  };
  add(true);
  num_sparse = num_samples;
  end_of_sparse = static_cast<int>(dx.size());
  add(false);
}

SimdSources::SimdSources(std::span<const PackedImage> images, std::span<const RelativeView> views)
    : num(static_cast<int>(images.size())) {
  for (int j = 0; j < num; ++j) {
    origin[j] = images[j].origin();
    stride[j] = images[j].stride();
    last_column[j] = images[j].width() - 1;
    last_row[j] = images[j].height() - 1;
    for (int k = 0; k < 9; ++k) a[k][j] = views[j].a.m[k];
    b[0][j] = views[j].b.x;
    b[1][j] = views[j].b.y;
    b[2][j] = views[j].b.z;
  }
}

}  // namespace phi
