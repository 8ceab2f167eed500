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

PHI_WIDE_VECTORS void Join(const float* x, const float* y, const float* z, const float* depth, std::size_t size,
                           phi::PlaneHypothesis* planes) {
  for (std::size_t i = 0; i < size; ++i) planes[i] = {{x[i], y[i], z[i]}, depth[i]};
}

}  // namespace

void PlaneChannels::Load(const phi::PlaneHypothesis* planes, std::size_t size) {
  Separate(planes, size, x.data(), y.data(), z.data(), depth.data());
}

void PlaneChannels::Store(std::size_t size, phi::PlaneHypothesis* planes) const {
  Join(x.data(), y.data(), z.data(), depth.data(), size, planes);
}

}  // namespace colmap_ext
