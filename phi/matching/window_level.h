// The window's scale, chosen per pixel: dilation carried on into an image pyramid where texture is weak.
//
// On a painted wall the contrast inside a 15 pixel window is about the sensor's noise and ZNCC ranks noise. Half the
// resolution halves the noise and doubles the window; a pixel takes the finest level whose window has contrast well
// above what noise leaves there. Textured pixels stay at level 0, so no detail is lost.
#pragma once

#include <cstdint>

#include "phi/base/hd.h"
#include "phi/matching/zncc.h"

namespace phi {

inline constexpr int kMaxPyramidLevels = 4;  // level 3: 1/8 of the resolution

// Variance (squared grey levels) that a window needs at level 0. White noise falls by 4 per level, and so does the
// variance that a window needs.
inline constexpr float kWindowVariance = 3.0f;

// Variance of the samples of a window centred at (u, v), K's coordinates of that level, weighted as the matching cost
// weights them: contrast that another surface brings into the window does not help to match this one.
template <class Sampler>
PHI_HD float WindowVariance(const Sampler& image, const MatchingWindow& window, float u, float v) {
  const int n = window.samples_per_side;
  const float shift = image(u, v);
  float sum = 0, squares = 0, total = 0;
  for (int row = -n; row <= n; ++row) {
    for (int column = -n; column <= n; ++column) {
      const float s = image(u + column * window.step, v + row * window.step) - shift;
      const float w = window.Weight(s);
      total += w;
      sum += w * s;
      squares += w * s * s;
    }
  }
  const float inverse = 1.0f / total;
  return (squares - sum * sum * inverse) * inverse;
}

// The pyramid level for the pixel (u, v) (K's coordinates of level 0); the coarsest where none has enough contrast.
template <class Sampler>
PHI_HD int SelectWindowLevel(const Sampler* levels, int num_levels, const MatchingWindow& window, float u,
                             float v) {
  float needed = kWindowVariance, scale = 1.0f;
  for (int level = 0; level + 1 < num_levels; ++level) {
    if (WindowVariance(levels[level], window, u * scale, v * scale) >= needed) return level;
    needed *= 0.25f;
    scale *= 0.5f;
  }
  return num_levels - 1;
}

// The homography between images that are both reduced by `scale` (level l: 2^-l), from that between the full ones.
PHI_HD Mat3f ScaleHomography(Mat3f h, float scale) {
  h.m[2] *= scale;
  h.m[5] *= scale;
  h.m[6] /= scale;
  h.m[7] /= scale;
  return h;
}

}  // namespace phi
