// Matching cost of a plane hypothesis over a dilated window (paper Eq. 4): C = 1 - ZNCC, in [0, 2].
//
// This is the readable reference. phi/cpu and cuda/ hold faster forms, which are tested against it.
#pragma once

#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/base/vec.h"
#include "phi/geometry/device_camera.h"

namespace phi {

inline constexpr float kMaxCost = 2.0f;  // C_max = 1 - Z_min with Z_min = -1: also 'no match possible'

// Below this variance (squared grey levels) a window has no structure that survives 8-bit quantisation, whose
// own variance is 1/12.
inline constexpr float kMinVariance = 0.04f;

// Which of a window's samples a cost is made of. Sparse: four rows of four and the centre, whose weight is 1 whatever surrounds it, for
// telling a good hypothesis from a bad one at a seventh of the price.
enum class Samples { kAll, kSparse };

inline constexpr int kSparseSide = 4;
inline constexpr int kNumSparseSamples = kSparseSide * kSparseSide + 1;
inline constexpr int kMinSideForSparse = 4;  // samples a side of the least window in which the rows lie apart

// Row or column i of the four, counted from the centre of a window of n samples a side: near it and near the rim, on both sides.
PHI_HD constexpr int SparseOffset(int i, int n) {
  const int distance = i == 0 || i == kSparseSide - 1 ? (4 * n + 2) / 5 : (n + 2) / 5;
  return i < kSparseSide / 2 ? -distance : distance;
}

// (2 * samples_per_side + 1)^2 samples, `step` pixels apart.
struct MatchingWindow {
  int samples_per_side = 5;  // r_now
  float step = 1.4f;         // r_orig / r_now, pixels
  float narrow_step = 0;     // the same where texture is rich, see window_level.h; 0: no such windows
  float narrow_variance = 10;  // squared grey levels that the narrow form needs
  float level_variance = 3;  // the same of the whole one at level 0 of the pyramid, see window_level.h
  // Where the surface itself has texture, differences of brightness weigh less, see RangeStep in window_level.h.
  bool range_follows_texture = false;
  float weight_decay = 0;    // 1 / squared grey level; 0: all samples count the same (paper)

  // A sample counts less the more it differs from the window's centre: it may lie on another surface. One half at
  // sqrt(1 / weight_decay) grey levels. The square matters where paint meets a frame: its strong edge must not decide for
  // the faint wall, which an exponential in |difference| lets it do.
  PHI_HD float Weight(float difference) const { return exp2f(-weight_decay * difference * difference); }

  PHI_HD int NumSamples() const { return (2 * samples_per_side + 1) * (2 * samples_per_side + 1); }
  // The window's narrow form.
  PHI_HD MatchingWindow Narrow() const {
    MatchingWindow window = *this;
    window.step = narrow_step;
    return window;
  }

  PHI_HD float Radius() const { return samples_per_side * step; }
};

// Bilinear interpolation at (u, v) in K's coordinates (pixel centres at half-integers), clamped to the
// border.
struct GraySampler {
  ArrayView2D<const std::uint8_t> image;

  PHI_HD float operator()(float u, float v) const {
    const float x = Clamp(u - 0.5f, 0.0f, static_cast<float>(image.width - 1));
    const float y = Clamp(v - 0.5f, 0.0f, static_cast<float>(image.height - 1));
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const int x1 = x0 + 1 < image.width ? x0 + 1 : x0, y1 = y0 + 1 < image.height ? y0 + 1 : y0;
    const float fx = x - x0, fy = y - y0;
    const float top = image(x0, y0) + fx * (float(image(x1, y0)) - float(image(x0, y0)));
    const float bottom = image(x0, y1) + fx * (float(image(x1, y1)) - float(image(x0, y1)));
    return top + fy * (bottom - top);
  }
};

// ZNCC from weighted sums of samples that were shifted by a common value close to their mean (so that single precision
// suffices).
struct ZnccSums {
  float r = 0, rr = 0;          // reference
  float s = 0, ss = 0, rs = 0;  // source, product

  // total_weight: of all samples; their number where they all count the same.
  PHI_HD float Cost(float total_weight) const {
    const float inverse = 1.0f / total_weight;
    const float var_r = (rr - r * r * inverse) * inverse;
    const float var_s = (ss - s * s * inverse) * inverse;
    if (!(var_r >= kMinVariance) || !(var_s >= kMinVariance)) return kMaxCost;
    const float covariance = (rs - r * s * inverse) * inverse;
    return Clamp(1.0f - covariance / sqrtf(var_r * var_s), 0.0f, kMaxCost);
  }
};

// Applies a homography; z <= 0 means behind the source camera.
PHI_HD Vec3f Transform(const Mat3f& h, float u, float v) { return h * Vec3f{u, v, 1.0f}; }

// True when the window's four corners fall inside the source image: then, both being convex, all of its
// samples do.
PHI_HD bool WindowIsInside(const Mat3f& h, float u, float v, float radius, int width, int height) {
  for (int corner = 0; corner < 4; ++corner) {
    const Vec3f p = Transform(h, u + (corner & 1 ? radius : -radius), v + (corner & 2 ? radius : -radius));
    if (!(p.z > 0)) return false;
    const float su = p.x / p.z, sv = p.y / p.z;
    if (!(su >= 0.5f && sv >= 0.5f && su <= width - 0.5f && sv <= height - 0.5f)) return false;
  }
  return true;
}

// C(x, j) for the window around `center` and the homography source_from_reference. kMaxCost where the warped
// window, all of it, leaves the source image or the samples of either have no texture. Sampler: as GraySampler.
template <class Sampler>
PHI_HD float ZnccCost(const Sampler& reference, const Sampler& source, const MatchingWindow& window, ImagePoint center,
                      const Mat3f& h, Samples samples = Samples::kAll) {
  const float u = center.u, v = center.v;
  if (!WindowIsInside(h, u, v, window.Radius(), source.image.width, source.image.height)) return kMaxCost;
  const int n = window.samples_per_side;
  const float shift = reference(u, v);
  ZnccSums sums;
  float total_weight = 0;
  const auto add = [&](int row, int column) {
    const float ru = u + column * window.step, rv = v + row * window.step;
    const Vec3f p = Transform(h, ru, rv);
    const float r = reference(ru, rv) - shift;
    const float s = source(p.x / p.z, p.y / p.z) - shift;
    const float w = window.Weight(r);
    total_weight += w;
    sums.r += w * r;
    sums.rr += w * r * r;
    sums.s += w * s;
    sums.ss += w * s * s;
    sums.rs += w * r * s;
  };
  if (samples == Samples::kSparse) {
    for (int i = 0; i < kSparseSide; ++i) {
      for (int j = 0; j < kSparseSide; ++j) add(SparseOffset(i, n), SparseOffset(j, n));
    }
    add(0, 0);
  } else {
    for (int row = -n; row <= n; ++row) {
      for (int column = -n; column <= n; ++column) add(row, column);
    }
  }
  return sums.Cost(total_weight);
}

}  // namespace phi
