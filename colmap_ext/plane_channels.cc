#include "colmap_ext/plane_channels.h"

#include "phi/base/wide_vectors.h"

namespace colmap_ext {
namespace {

PHI_WIDE_VECTORS void Separate(const phi::PlaneHypothesis* planes, std::size_t size, float* x, float* y, float* z, float* depth) {
  for (std::size_t i = 0; i < size; ++i) {
    x[i] = planes[i].normal.x;
    y[i] = planes[i].normal.y;
    z[i] = planes[i].normal.z;
    depth[i] = planes[i].depth;
  }
}

}  // namespace

void PlaneChannels::Load(const phi::PlaneHypothesis* planes, std::size_t size) {
  Separate(planes, size, x.data(), y.data(), z.data(), depth.data());
}

}  // namespace colmap_ext
