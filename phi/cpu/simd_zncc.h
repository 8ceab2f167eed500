// The vectorised matching cost (paper Eq. 4) through Google Highway; the instruction set is chosen at run
// time.
//
// Samples lie across lanes. Sums are kept in 16 running totals and joined in one fixed order whatever the
// vector's length, so results are equal to the bit on all instruction sets with fused multiply-add (AVX2,
// AVX-512, NEON); without it (SSE4) they differ in rounding. phi/matching/zncc.h is the readable form.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "phi/cpu/simd_image.h"
#include "phi/geometry/device_camera.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/matching/zncc.h"

namespace phi {

inline constexpr int kSimdChunk = 16;                 // samples; the longest vector has so many lanes
inline constexpr int kMaxSimdSamples = 66 * 64 + 16;  // of a window with r_now = 32, in whole chunks

// Offsets of the window's samples from its centre, pixels; padded to whole chunks with the centre itself.
struct SimdWindow {
  SimdWindow(const MatchingWindow& window, Samples samples);
  int num_samples = 0;
  float radius = 0;  // of all samples
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

// Reference samples: weighted, zero mean, unit variance; zero in the padding.
struct SimdPatch {
  bool textured;                               // false: no cost below kMaxCost is possible
  alignas(64) float samples[kMaxSimdSamples];  // weight * (sample - mean) / deviation
  alignas(64) float weights[kMaxSimdSamples];  // their sum is 1
};

// Inverse depth at the window's centre and its change per pixel.
struct PlaneAtPixel {
  double inverse_depth, per_column, per_row;
};

// (u, v): the window's centre in the reference, K's coordinates. weight_decay: as MatchingWindow's.
void LoadSimdPatch(const PackedImage& reference, const SimdWindow& window, float weight_decay, float u,
                   float v, SimdPatch* patch);
// Returns how many source windows it read: not those that leave their image.
int SimdZnccCosts(const SimdWindow& window, const SimdSources& sources, const SimdPatch& patch,
                  double u, double v, const PlaneAtPixel& plane, float* costs);

// "AVX2", "AVX3", "SSE4", ...
std::string SimdTargetName();

}  // namespace phi
