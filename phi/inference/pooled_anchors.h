// What the source views measured, as anchors of the reference image's regions.
//
// One view often measures an even wall only along a rim or in a corner, and a plane through that is poorly determined.
// Other views see other parts of the wall against other surroundings: their measured pixels, projected into the
// reference image, carry the same plane.
#pragma once

#include <cstdint>
#include <vector>

#include "phi/backend.h"
#include "phi/inference/relative_exposure.h"

namespace phi {

// Pixels of a source view that are projected at most, so that time and memory stay bounded: every second one of every
// second row of a megapixel, every third one and so on of larger images.
inline constexpr std::int64_t kMaxPooledPerView = std::int64_t{1} << 18;

// Grey levels, after the images' exposures were made alike. A point that is hidden in the reference image lands on what
// hides it, which often has another brightness; an even surface keeps its own but for noise and a slight gloss.
inline constexpr float kMaxBrightnessChange = 6;

struct PooledAnchor {
  float x = 0, y = 0;       // where it lies in the reference image, array indices with fraction
  float inverse_depth = 0;  // in the reference camera
  std::uint32_t hash = 0;   // of the source view's image id and pixel: uniform, the same in every run
  bool is_measured = true;  // by the source view; a clue otherwise

  friend bool operator==(const PooledAnchor&, const PooledAnchor&) = default;

  int PixelX() const { return static_cast<int>(x + 0.5f); }
  int PixelY() const { return static_cast<int>(y + 0.5f); }
};

// Measured pixels and clues of the source views that land on a pixel without depth that is about as bright. Same order for any
// number of threads. Views without a map take no part. `exposures`, if not null: of each source view.
std::vector<PooledAnchor> PoolAnchors(const InferenceInput& input, const Rules& rules = {},
                                      std::vector<RelativeExposure>* exposures = nullptr);

}  // namespace phi
