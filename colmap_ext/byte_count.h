// Numbers of bytes from options in gigabytes.
#pragma once

#include <algorithm>
#include <cstdint>

namespace colmap_ext {

inline constexpr double kBytesPerGigabyte = 1024.0 * 1024.0 * 1024.0;  // as COLMAP counts its cache

// Whole bytes; what no computer has becomes an exabyte, which fits the integer.
inline std::int64_t ByteCount(double num_bytes) {
  return static_cast<std::int64_t>(std::min(num_bytes, 1e18));
}

}  // namespace colmap_ext
