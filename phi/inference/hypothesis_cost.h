// Matching cost of a hypothesis before it has a normal: the window's samples are back-projected with the direction's
// own hypothesis map, not with one plane.
#pragma once

#include "phi/geometry/device_camera.h"
#include "phi/inference/line_hypothesis.h"
#include "phi/inference/shown_point.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/matching/window_level.h"
#include "phi/matching/zncc.h"

namespace phi {

// Inverse depth at a window's sample: the map's pixel there; where it has none, the window's centre's.
PHI_HD float SampleInverseDepth(ArrayView2D<const float> inverse_depth, float u, float v, float center) {
  const int x = static_cast<int>(Clamp(u, 0.0f, static_cast<float>(inverse_depth.width - 1)));
  const int y = static_cast<int>(Clamp(v, 0.0f, static_cast<float>(inverse_depth.height - 1)));
  const float w = inverse_depth(x, y);
  return w > 0 ? w : center;
}

// A source view's image and where it stands.
template <class Sampler>
struct SampledView {
  const Sampler& image;
  const RelativeView& view;
};

// C(x, j) of pixel (x, y) for one direction's map (inverse depth, hypotheses and measured pixels together). kMaxCost
// where any sample leaves the source image, or either window has no texture.
template <class Sampler>
PHI_HD float HypothesisViewCost(const Sampler& reference, const SampledView<Sampler>& source, const MatchingWindow& window,
                                ArrayView2D<const float> inverse_depth, int x, int y) {
  const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
  const float center = inverse_depth(x, y);
  const float max_u = static_cast<float>(source.view.source.width) - 0.5f,
              max_v = static_cast<float>(source.view.source.height) - 0.5f;
  const int n = window.samples_per_side;
  const float shift = reference(u, v);
  ZnccSums sums;
  for (int row = -n; row <= n; ++row) {
    bool is_inside = true;  // without a branch at each sample, whose reads would wait for each other
    for (int column = -n; column <= n; ++column) {
      const float ru = u + column * window.step, rv = v + row * window.step;
      const Vec3f p = ProjectInverseDepth(source.view, ru, rv, SampleInverseDepth(inverse_depth, ru, rv, center));
      const float su = p.x / p.z, sv = p.y / p.z;
      const bool is_sample_inside = (p.z > 0) & (su >= 0.5f) & (sv >= 0.5f) & (su <= max_u) & (sv <= max_v);
      is_inside &= is_sample_inside;
      const float r = reference(ru, rv) - shift;
      const float s = source.image(is_sample_inside ? su : 0.5f, is_sample_inside ? sv : 0.5f) - shift;
      sums.r += r;
      sums.rr += r * r;
      sums.s += s;
      sums.ss += s * s;
      sums.rs += r * s;
    }
    if (!is_inside) return kMaxCost;
  }
  return sums.Cost(static_cast<float>(window.NumSamples()));
}

// The hypotheses of one pixel. Bit k of a mask: direction k.
struct PixelHypotheses {
  float cost[kNumDirections] = {kMaxCost, kMaxCost, kMaxCost, kMaxCost};
  std::uint8_t offered = 0;  // there is a hypothesis

  // The one of lowest cost, ties to the lowest index; -1 = none.
  PHI_HD int Cheapest() const {
    int best = -1;
    for (int k = 0; k < kNumDirections; ++k) {
      if ((offered >> k & 1) && (best < 0 || cost[k] < cost[best])) best = k;
    }
    return best;
  }
};

// In units of the matching cost: small beside what texture says, decisive where there is none.
inline constexpr float kRegionPlaneDiscount = 0.05f;

// Planes that rest on an even region's many measured pixels are likelier than lines through six. Bit k of `from_region`:
// hypothesis k is such a plane; scale: of the discount.
PHI_HD void PreferRegionPlanes(std::uint8_t from_region, PixelHypotheses* hypotheses, float scale = 1) {
  for (int k = 0; k < kNumDirections; ++k) {
    if (from_region >> k & 1)
      hypotheses->cost[k] = Max(hypotheses->cost[k] - scale * kRegionPlaneDiscount, 0.0f);
  }
}

}  // namespace phi
