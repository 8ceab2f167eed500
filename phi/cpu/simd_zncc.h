// The vectorised matching cost (paper Eq. 4) through Google Highway; the instruction set is chosen at run
// time.
//
// Samples lie across lanes. Sums are kept in 16 running totals and joined in one fixed order whatever the
// vector's length, so results are equal to the bit on all instruction sets with fused multiply-add (AVX2,
// AVX-512, NEON); without it (SSE4) they differ in rounding. phi/matching/zncc.h is the readable form.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "phi/cpu/simd_image.h"
#include "phi/geometry/device_camera.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/matching/zncc.h"

namespace phi {

inline constexpr int kSimdChunk = 16;                 // samples; the longest vector has so many lanes
inline constexpr int kMaxSimdSamples = 66 * 64 + 16;  // of a window with r_now = 32, in whole chunks

// Offsets of the window's samples from its centre, pixels: the sparse ones, then the rest, each padded to whole chunks with the centre.
// The centre itself is not among them: less itself it is 0 in both images, and adds but its weight, 1.
struct SimdWindow {
  explicit SimdWindow(const MatchingWindow& window);
  int NumSamples(Samples samples) const { return samples == Samples::kAll ? num_samples : num_sparse; }

  int num_samples = 1, num_sparse = 1;  // with the centre
  int end_of_sparse = 0;  // with their padding
  float radius = 0;       // of all samples
  std::vector<float> dx, dy;
};

// Source images and their homographies' parts (see RelativeView), in double: a homography is taken at the window's centre, and
// only small differences reach single precision. Views lie across lanes.
struct SimdSources {
  SimdSources() = default;
  // images must outlive it.
  SimdSources(std::span<const PackedImage> images, std::span<const RelativeView> views);

  int num = 0;
  const std::uint32_t* origin[kMaxSourceViews] = {};
  std::int64_t stride[kMaxSourceViews] = {};
  alignas(64) double a[9][kMaxSourceViews] = {};
  alignas(64) double b[3][kMaxSourceViews] = {};
  alignas(64) double last_column[kMaxSourceViews] = {}, last_row[kMaxSourceViews] = {};
};

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

// Of the samples so far, less the one at the centre, by source view. What ranked a hypothesis is part of what scores it.
struct SimdSums {
  std::uint32_t inside = 0;         // bit j: view j's window lies inside its image; the sums of others mean nothing
  alignas(16) float of_view[kMaxSourceViews][4];  // weight * source, weight * source^2, weight * reference * source; a padding
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
void AddOtherSamples(const SimdWindow& window, const SimdSources& sources, const SimdPatch& patch, const PlaneAtPoint& plane,
                     SimdSums* sums);
// The cost in each source view (Eq. 4) of what was summed.
void CostsOfSums(const SimdReference& reference, const SimdSums& sums, int num_views, float* costs);

}  // namespace phi
