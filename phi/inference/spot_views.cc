#include "phi/inference/spot_views.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "phi/geometry/depth_agreement.h"
#include "phi/inference/confirmation.h"
#include "phi/inference/pooled_anchors.h"

namespace phi {

SpotViews::SpotViews(const InferenceInput& input, std::span<const float> gains)
    : reference_(input.reference.image.get()) {
  const std::size_t num_views = std::min(input.sources.size(), input.source_depths.size());
  for (std::size_t j = 0; j < num_views; ++j) {
    const ViewImage& source = input.sources[j];
    sources_.push_back({MakeRelativeView(input.reference.view->camera, source.view->camera),
                        source.image.get(), input.source_depths[j].get(), gains[j]});
  }
}

double SpotViews::Unlike(const Spot& spot, double inverse_depth) const {
  if (!(inverse_depth >= 0)) return 1;
  const auto w = static_cast<float>(inverse_depth);
  const float own = (*reference_)(spot.x, spot.y);
  int num_like = 0, num_unlike = 0;
  for (const Source& source : sources_) {
    const Vec3f p = ProjectInverseDepth(source.view, static_cast<float>(spot.x) + 0.5f,
                                        static_cast<float>(spot.y) + 0.5f, w);
    if (!(p.z > 0)) continue;
    const float u = p.x / p.z, v = p.y / p.z;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(source.image->width()) &&
          v < static_cast<float>(source.image->height())))
      continue;
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    if (source.depths != nullptr && IsMeasured(source.depths->states(x, y)) &&
        !DepthsAgree(p.z, source.depths->depths(x, y) * w, kDepthGap)) {
      continue;
    }
    const float change = own - source.gain * (*source.image)(x, y);
    ++(std::abs(change) <= kMaxBrightnessChange ? num_like : num_unlike);
  }
  return num_unlike == 0 ? 0 : static_cast<double>(num_unlike) / (num_like + num_unlike);
}

}  // namespace phi
