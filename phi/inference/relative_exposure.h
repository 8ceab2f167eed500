// How bright the reference image shows what a source image shows: exposures differ, lenses darken the corners of their images, and what
// is too bright is cut off.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "phi/geometry/camera.h"

namespace phi {

// Squared distance from the principal point, over that of a corner from the image's middle.
class RadiusOfPixels {
 public:
  explicit RadiusOfPixels(const Pinhole& pinhole);
  float Squared(int x, int y) const {
    const float u = static_cast<float>(x) + 0.5f - cx_, v = static_cast<float>(y) + 0.5f - cy_;
    return (u * u + v * v) * scale_;
  }

 private:
  float cx_, cy_, scale_;
};

// A spot in an image.
struct BrightSpot {
  float brightness = 0;      // grey levels
  float squared_radius = 0;  // RadiusOfPixels
};

struct SpotPair {
  BrightSpot reference, source;
};

// Lenses darken by the fourth power of the cosine of the angle to the axis, and by more of that form: without the falloff c an
// image would be (1 + c / 2 * squared radius)^2 times as bright.
class RelativeExposure {
 public:
  // `gain`: the reference's brightness over the source's.
  explicit RelativeExposure(float gain = 1) : gain_(gain) {}

  // Of each source, from spots that it and the reference show: its gain and falloff, and the reference's falloff, which all tell of
  // together. A gain of 1 where spots are few. Glossy and mistaken ones do not matter, falloff is found as far as many spots tell of it.
  static std::vector<RelativeExposure> Fit(std::span<const std::vector<SpotPair>> pairs_of_sources, std::size_t min_num_pairs);

  // Of the reference against itself, by what its sources tell of its falloff.
  static RelativeExposure OfOneImage(std::span<const RelativeExposure> exposures);

  // Grey levels by which the reference's spot is brighter than the source's would be there. 0 where either may be cut off at white.
  float Change(const BrightSpot& reference, const BrightSpot& source) const;

  // Of a reference's spot's brightness over a source's that shows the same; both by their squared radius.
  float Ratio(float reference, float source) const {
    const float over = (1 + source_falloff_ / 2 * source) / (1 + reference_falloff_ / 2 * reference);
    return gain_ * over * over;
  }

  float gain() const { return gain_; }

 private:
  float gain_;
  float reference_falloff_ = 0, source_falloff_ = 0;
};

}  // namespace phi
