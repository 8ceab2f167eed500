// The verdict on one point, for all tolerances at once, in one byte.
//
// A point that is right at some tolerance is right at every larger one, so the index of the first tolerance
// that holds says everything: class c is right at tolerances c, c + 1, ... and wrong (or unobserved) below.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace colmap_ext {

using ToleranceClass = std::uint8_t;

inline constexpr int kMaxTolerances = 32;
// Set on a class when nothing contradicts the point below its first right tolerance: there it is not counted.
inline constexpr ToleranceClass kUnobservedBelow = 0x40;
// The point takes no part at all.
inline constexpr ToleranceClass kNotCounted = 0x80;

inline int FirstRightTolerance(ToleranceClass c) { return c & 0x3F; }

// One sentence when `tolerances` (world units) is empty, too long, not positive or not ascending; else empty.
std::string CheckTolerances(const std::vector<double>& tolerances);

}  // namespace colmap_ext
