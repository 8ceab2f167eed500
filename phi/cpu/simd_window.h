// What the vectorised matching cost (simd_zncc.h) reads: the windows' samples and the source images, laid out for vectors.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "phi/cpu/simd_image.h"
#include "phi/geometry/device_camera.h"
#include "phi/matching/cost_aggregation.h"
#include "phi/matching/zncc.h"

namespace phi {

inline constexpr int kSimdChunk = 16;  // samples; the longest vector has so many lanes

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

}  // namespace phi
