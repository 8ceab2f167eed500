#include "phi/inference/source_anchors.h"

#include <cstddef>
#include <limits>

#include "phi/base/wide_vectors.h"

namespace phi {
namespace {

// A SourceAnchorRow's arrays, apart.
struct RowArrays {
  std::ptrdiff_t size;
  float *__restrict u, *__restrict v, *__restrict inverse_depth;
};

// inverse_depth holds the pixels' depths before; NaN: none. By value what is read in the loop, so that the compiler sees that the
// arrays change none of it.
PHI_WIDE_VECTORS void ProjectRow(const RayModel rays, const RelativeView view, int y, int step, const RowArrays row) {
  for (std::ptrdiff_t i = 0; i < row.size; ++i) {
    const Vec3f ray = rays.Ray(static_cast<float>(static_cast<int>(i) * step) + 0.5f, static_cast<float>(y) + 0.5f);
    const Vec3f point = view.rotation * (row.inverse_depth[i] * ray) + view.translation;
    const ImagePoint seen = view.source.Project(point);
    const float inverse = 1 / point.z;
    row.u[i] = seen.u;
    row.v[i] = seen.v;
    row.inverse_depth[i] = point.z > 0 ? inverse : 0;
  }
}

}  // namespace

void SourceAnchors::FindRow(int y, int step, SourceAnchorRow* row) const {
  const auto size = static_cast<std::size_t>((depths_.width() + step - 1) / step);
  row->u.resize(size), row->v.resize(size), row->inverse_depth.resize(size);
  const float* depth = &depths_.depths(0, y);
  const PixelState* state = &depths_.states(0, y);
  for (float& found : row->inverse_depth) {
    found = CarriesPlanes(*state) ? *depth : std::numeric_limits<float>::quiet_NaN();
    depth += step, state += step;
  }
  ProjectRow(rays_, reference_from_source_, y, step,
             {static_cast<std::ptrdiff_t>(size), row->u.data(), row->v.data(), row->inverse_depth.data()});
}

}  // namespace phi
