// What cameras make of brightness beside exposure and the lens's falloff: curves of tones, and parts of a photo made brighter or darker
// than others, by a telephone's processing, by flash light or by the sun's.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "phi/base/array2d.h"
#include "phi/inference/bright_spot.h"

namespace phi {

// A factor of brightness that is smooth over a photo: its logarithm is a sum of cosines, which over the width and the height together
// have at most kOrder half waves.
class ToneField {
 public:
  static constexpr int kOrder = 4, kNumTerms = kOrder * (kOrder + 3) / 2;
  using Terms = Eigen::Matrix<float, kNumTerms, 1>;

  // Of the logarithm, for a factor of 1 each; (u, v): BrightSpot.
  static Terms TermsAt(float u, float v);
  // Half waves of each term.
  static Terms OrderOfTerms();

  explicit ToneField(const Terms& factors);

  // Interpolated in a table.
  float At(float u, float v) const;

  std::size_t bytes() const { return table_.bytes(); }

 private:
  Array2D<float> table_;
};

// Spots that the reference and a source measured.
struct SharedTones {
  std::span<const SpotPair> pairs;
  // Of each, the logarithm of the reference's brightness over what exposures and falloffs make of the source's.
  std::vector<float> unexplained;
};

// Of the reference and a source.
class PhotoTones {
 public:
  // Of each source: an exponent and a field of its own, and the reference's field, which all tell of together. By least squares, robust;
  // `prior` holds all of them near none, as much as that share of a source's spots would that show none, for each half wave. Fitted to
  // some parts of the reference, they must leave a tenth less unexplained in the others than no tones do; empty: they do not.
  static std::vector<std::shared_ptr<const PhotoTones>> Fit(std::span<const SharedTones> sources, double prior);

  // The reference against itself.
  std::shared_ptr<const PhotoTones> OfReference() const;

  // What the source's brightness, its exposure and falloff made alike, is to be multiplied by.
  float Factor(const BrightSpot& reference, const BrightSpot& source) const;
  // By how many per cent that product grows with each per cent of the source's brightness.
  float Slope() const { return 1 + exponent_; }

  // Without the reference's field, which all sources' share.
  std::size_t bytes() const { return sizeof(*this) + source_->bytes() + factors_.size() * sizeof(factors_[0]); }

 private:
  PhotoTones(std::shared_ptr<const ToneField> reference, std::shared_ptr<const ToneField> source, float gain, float exponent);

  std::shared_ptr<const ToneField> reference_, source_;
  float exponent_;  // beside 1
  std::vector<float> factors_;  // of the gain and the exponent, by grey level
};

}  // namespace phi
