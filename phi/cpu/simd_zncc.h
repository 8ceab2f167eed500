// The vectorised matching cost (paper Eq. 4) through Google Highway; the instruction set is chosen at run
// time.
//
// Samples lie across lanes. Sums are kept in 16 running totals and joined in one fixed order whatever the
// vector's length, so results are equal to the bit on all instruction sets with fused multiply-add (AVX2,
// AVX-512, NEON); without it (SSE4) they differ in rounding. phi/matching/zncc.h is the readable form.
#pragma once

#include <cstdint>

#include "phi/cpu/simd_image.h"
#include "phi/cpu/simd_window.h"
#include "phi/matching/cost_aggregation.h"

namespace phi {

inline constexpr int kMaxSimdSamples = 66 * 64 + 16;  // of a window with r_now = 32, in whole chunks

// What a cost needs of some of the reference's samples.
struct SimdReference {
  bool textured;  // false: no cost below kMaxCost is possible
  float variance, inverse_weight, mean, inverse_deviation;
};

// The reference's samples, less the one at the centre; zero in the padding.
struct SimdPatch {
  SimdReference sparse, all;
  alignas(64) float weights[kMaxSimdSamples];
  alignas(64) float weighted[kMaxSimdSamples];  // weight * sample
};

// The homographies around the window's centre, by view. With offsets (dx, dy) from the centre and w = 1 + wx dx + wy dy, the
// source's element is (x + (xx dx + xy dy) / w, y + (yx dx + yy dy) / w), counted from element (column, row): one element before the
// window's first, so that positions are about 1 at least.
struct LocalWarps {
  alignas(64) float wx[kMaxSourceViews], wy[kMaxSourceViews];
  alignas(64) float xx[kMaxSourceViews], xy[kMaxSourceViews], yx[kMaxSourceViews], yy[kMaxSourceViews];
  alignas(64) float x[kMaxSourceViews], y[kMaxSourceViews];
  alignas(64) double column[kMaxSourceViews], row[kMaxSourceViews];
};

// Of the samples so far, less the one at the centre, by source view. What ranked a hypothesis is part of what scores it, and so is
// where its windows lie.
struct SimdSums {
  std::uint32_t inside = 0;  // bit j: view j's window lies inside its image; the sums of others mean nothing
  // weight * source, weight * source^2, weight * reference * source; then no sum, but the centre's sample
  alignas(16) float of_view[kMaxSourceViews][4];
  LocalWarps warps;
};
static_assert(kMaxSourceViews <= 32);

// A plane around a window's centre (u, v) in the reference, K's coordinates: inverse depth there and its change per pixel.
struct PlaneAtPoint {
  double u, v;
  double inverse_depth, per_column, per_row;
};

// (u, v): the window's centre in the reference, K's coordinates. weight_decay: as MatchingWindow's.
void LoadSimdPatch(const PackedImage& reference, const SimdWindow& window, float weight_decay, float u,
                   float v, SimdPatch* patch);
// Sums over the sparse samples alone.
void SumSparseSamples(const SimdWindow& window, const SimdSources& sources, const SimdPatch& patch, const PlaneAtPoint& plane,
                      SimdSums* sums);
// The same plane's sums over all samples, from those over the sparse ones.
void AddOtherSamples(const SimdWindow& window, const SimdSources& sources, const SimdPatch& patch, SimdSums* sums);
// The cost in each source view (Eq. 4) of what was summed.
void CostsOfSums(const SimdReference& reference, const SimdSums& sums, int num_views, float* costs);

}  // namespace phi
