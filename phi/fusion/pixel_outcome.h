// What fusion made of the pixels of an image.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace phi {

enum class PixelOutcome : std::uint8_t {
  kFused,    // gave a point
  kCovered,  // an earlier image's point covers it
  kNoDepth,
  kTooFewViews,   // too few images see the spot and have depth there
  kDepth,         // too few agree on depth
  kReprojection,  // too few of those agree within the reprojection error
  kNormal,        // too few of those agree on the normal
  kSeenThrough,   // images see through the point to something behind it
  kWeakSupport,   // enough images agree, but only just
  kImprobable,    // its confidence is too low
  kOutsideBox,
};
inline constexpr int kNumPixelOutcomes = 11;

class OutcomeCounts {
 public:
  std::int64_t& operator[](PixelOutcome outcome) { return counts_[static_cast<std::size_t>(outcome)]; }
  std::int64_t operator[](PixelOutcome outcome) const { return counts_[static_cast<std::size_t>(outcome)]; }
  OutcomeCounts& operator+=(const OutcomeCounts& other) {
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
    return *this;
  }

 private:
  std::array<std::int64_t, kNumPixelOutcomes> counts_{};
};

}  // namespace phi
