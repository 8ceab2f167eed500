// The window's scale, chosen per pixel: narrow where texture is rich, dilation carried on into an image pyramid where it
// is weak.
//
// Dilation buys texture at the price of detail: a wide window's samples lie on surfaces beside the pixel's own. Where a
// narrow window, samples one pixel apart, has contrast enough, it is taken. Noise decides what is enough.
//
// On a painted wall the contrast inside a 15 pixel window is about the sensor's noise and ZNCC ranks noise. Half the
// resolution halves the noise and doubles the window; a pixel takes the finest level whose window has contrast well
// above what noise leaves there (MatchingWindow::level_variance at level 0; white noise falls by 4 per level, and so does the
// variance that a window needs). Textured pixels stay at level 0, so no detail is lost.
#pragma once

#include <cstdint>

#include "phi/base/hd.h"
#include "phi/matching/zncc.h"

namespace phi {

inline constexpr int kMaxPyramidLevels = 4;  // level 3: 1/8 of the resolution

inline constexpr float kNarrowStep = 1.0f;  // pixels between the samples of a narrow window
// Variance that it needs: twice the noise's, within these limits.
inline constexpr float kNarrowVarianceOverNoise = 2.0f;
inline constexpr float kMinNarrowVariance = 1.0f, kMaxNarrowVariance = 10.0f;

// `noise`: standard deviation, grey levels; scale: of the result.
inline float NarrowWindowVariance(double noise, float scale = 1) {
  return scale * Clamp(kNarrowVarianceOverNoise * static_cast<float>(noise * noise), kMinNarrowVariance,
                       kMaxNarrowVariance);
}

// Variance that the whole window needs at level 0: the noise's and a tenth more, or this if it is more.
inline constexpr float kMinLevelVariance = 3.0f, kLevelVarianceOverNoise = 1.1f;

inline float LevelVariance(double noise, float scale = 1) {
  return scale * Max(kLevelVarianceOverNoise * static_cast<float>(noise * noise), kMinLevelVariance);
}

inline constexpr int kMaxRangeStep = 7;

struct WindowScale {
  std::uint8_t level = 0;  // of the pyramid
  bool is_narrow = false;  // samples MatchingWindow::narrow_step apart; at level 0 only
  // The half-weight difference is 1 + range_step / kMaxRangeStep times MatchingWindow's, see RangeStep.
  std::uint8_t range_step = 0;
};

// How much wider the range of brightness may be that counts as the centre's own surface. `variance`: of the window, weighted. A
// plain pixel beside an edge has little: the edge's other side has no weight. Where the surface itself has texture the
// samples fill the range that the weight leaves them, up to the variance of an evenly spread brightness, 1 / (2 ln 2 decay):
// then the range cuts through one surface, and is doubled; in between in proportion. At full size only: in a reduced image a
// window spans thin things and what is behind them, and the narrow range keeps these apart.
PHI_HD std::uint8_t RangeStep(const MatchingWindow& window, float variance) {
  if (!window.range_follows_texture) return 0;
  const float filled = Min(2 * 0.69314718f * window.weight_decay * variance, 1.0f);
  return static_cast<std::uint8_t>(filled * kMaxRangeStep + 0.5f);
}

// The window of a pixel, in pixels of its level.
PHI_HD MatchingWindow WindowAtScale(const MatchingWindow& window, WindowScale scale) {
  MatchingWindow result = scale.is_narrow ? window.Narrow() : window;
  const float wider = 1 + static_cast<float>(scale.range_step) / kMaxRangeStep;
  result.weight_decay /= wider * wider;
  return result;
}

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

// The scale for the pixel (u, v) (K's coordinates of level 0); the coarsest level where none has enough contrast.
// variance(level, is_narrow, u, v): WindowVariance of the whole or the narrow window on that level.
template <class Variance>
PHI_HD WindowScale SelectWindowScaleBy(const Variance& variance_of, int num_levels, const MatchingWindow& window, float u,
                                       float v) {
  WindowScale result;
  if (window.narrow_step > 0) {
    const float variance = variance_of(0, true, u, v);
    result.is_narrow = variance >= window.narrow_variance;
    if (result.is_narrow) result.range_step = RangeStep(window, variance);
  }
  if (result.is_narrow) return result;
  float needed = window.level_variance, scale = 1.0f;
  for (; result.level + 1 < num_levels; ++result.level) {
    const float variance = variance_of(result.level, false, u * scale, v * scale);
    if (variance >= needed) {
      if (result.level == 0) result.range_step = RangeStep(window, variance);
      break;
    }
    needed *= 0.25f;
    scale *= 0.5f;
  }
  return result;
}

// The same, from the levels' images.
template <class Sampler>
PHI_HD WindowScale SelectWindowScale(const Sampler* levels, int num_levels, const MatchingWindow& window,
                                     float u, float v) {
  const auto variance = [&](int level, bool is_narrow, float at_u, float at_v) {
    return WindowVariance(levels[level], is_narrow ? window.Narrow() : window, at_u, at_v);
  };
  return SelectWindowScaleBy(variance, num_levels, window, u, v);
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
