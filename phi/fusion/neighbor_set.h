// Some of the neighbours of an image, by their place in its list: of the same size on the host and on a device.
#pragma once

#include <cstdint>

#include "phi/fusion/neighbor_lookup.h"

namespace phi {

class NeighborSet {
 public:
  PHI_HD void Add(int k) { words_[k / kBits] |= 1u << k % kBits; }
  PHI_HD bool Contains(int k) const { return (words_[k / kBits] >> k % kBits & 1u) != 0; }
  bool operator==(const NeighborSet&) const = default;

 private:
  static constexpr int kBits = 32;
  static_assert(kMaxFusionNeighbors % kBits == 0);
  std::uint32_t words_[kMaxFusionNeighbors / kBits] = {};
};

}  // namespace phi
