// How bright the reference image shows what a source image shows: exposures differ, lenses darken the corners of their images, cameras
// make of brightness what they like, and what is too bright is cut off.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "phi/inference/bright_spot.h"
#include "phi/inference/photo_tones.h"

namespace phi {

// Lenses darken by the fourth power of the cosine of the angle to the axis, and by more of that form: without the falloff c an
// image would be (1 + c / 2 * squared radius)^2 times as bright.
class RelativeExposure {
 public:
  // `gain`: the reference's brightness over the source's.
  explicit RelativeExposure(float gain = 1) : gain_(gain) {}

  // Of each source, from spots that it and the reference show: its gain and falloff, and the reference's falloff, which all tell of
  // together. A gain of 1 where spots are few. Glossy and mistaken ones do not matter, falloff is found as far as many spots tell of it.
  // Then tones, by the same spots; `tone_prior`: of PhotoTones::Fit, 0 for no tones.
  static std::vector<RelativeExposure> Fit(std::span<const std::vector<SpotPair>> pairs_of_sources, std::size_t min_num_pairs,
                                           double tone_prior = 0);

  // Of the reference against itself, by what its sources tell of its falloff and tones.
  static RelativeExposure OfOneImage(std::span<const RelativeExposure> exposures);

  // Grey levels by which the reference's spot is brighter than the source's would be there. 0 where either may be cut off at white.
  float Change(const BrightSpot& reference, const BrightSpot& source) const;

  // Of a reference's spot's brightness over a source's that shows the same.
  float Ratio(const BrightSpot& reference, const BrightSpot& source) const {
    const float ratio = RatioOfExposures(reference, source);
    return tones_ == nullptr ? ratio : ratio * tones_->Factor(reference, source);
  }
  // Of the reference's brightness with the source's.
  float Slope(const BrightSpot& reference, const BrightSpot& source) const {
    const float ratio = Ratio(reference, source);
    return tones_ == nullptr ? ratio : ratio * tones_->Slope();
  }

  float gain() const { return gain_; }
  std::size_t bytes() const { return sizeof(*this) + (tones_ == nullptr ? 0 : tones_->bytes()); }

 private:
  SharedTones Unexplained(std::span<const SpotPair> pairs) const;

  // Without tones.
  float RatioOfExposures(const BrightSpot& reference, const BrightSpot& source) const {
    const float over =
        (1 + source_falloff_ / 2 * source.squared_radius) / (1 + reference_falloff_ / 2 * reference.squared_radius);
    return gain_ * over * over;
  }

  float gain_;
  float reference_falloff_ = 0, source_falloff_ = 0;
  std::shared_ptr<const PhotoTones> tones_;  // null: none
};

}  // namespace phi
