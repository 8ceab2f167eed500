// Counter-based random numbers (Philox4x32-10, Salmon et al., "Parallel random numbers: as easy as 1, 2, 3",
// SC 2011).
//
// A draw is a pure function of (seed, image id, pixel, iteration, draw), so results do not depend on the
// number of threads, on tiles, on GPUs or on the order in which pixels are visited.
#pragma once

#include <cstdint>

#include "phi/base/hd.h"

namespace phi {

struct RandomKey {
  std::uint32_t seed = 0;
  std::uint32_t image_id = 0;  // COLMAP's image id
};

struct Random4 {
  std::uint32_t v[4];
};

PHI_HD std::uint32_t MulHigh32(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint32_t>((static_cast<std::uint64_t>(a) * b) >> 32);
}

// Four independent 32-bit words for one pixel. `pixel` is y * width + x; `draw` numbers the calls within an
// iteration.
PHI_HD Random4 Philox(RandomKey key, std::uint64_t pixel, std::uint32_t iteration, std::uint32_t draw) {
  std::uint32_t c0 = static_cast<std::uint32_t>(pixel), c1 = static_cast<std::uint32_t>(pixel >> 32);
  std::uint32_t c2 = iteration, c3 = draw;
  std::uint32_t k0 = key.seed, k1 = key.image_id;
  for (int round = 0; round < 10; ++round) {
    const std::uint32_t hi0 = MulHigh32(0xD2511F53u, c0), lo0 = 0xD2511F53u * c0;
    const std::uint32_t hi1 = MulHigh32(0xCD9E8D57u, c2), lo1 = 0xCD9E8D57u * c2;
    c0 = hi1 ^ c1 ^ k0;
    c1 = lo1;
    c2 = hi0 ^ c3 ^ k1;
    c3 = lo0;
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  return {{c0, c1, c2, c3}};
}

// Uniform in [0, 1), with 24 bits.
PHI_HD float UniformFloat(std::uint32_t word) { return static_cast<float>(word >> 8) * (1.0f / 16777216.0f); }

// Uniform in [-1, 1).
PHI_HD float SymmetricFloat(std::uint32_t word) { return 2.0f * UniformFloat(word) - 1.0f; }

}  // namespace phi
