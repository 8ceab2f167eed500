// Some of the neighbours of an image, by their place in its list: of the same size on the host and on a device.
#pragma once

#include <bit>
#include <cstdint>

#include "phi/fusion/neighbor_lookup.h"

namespace phi {

class NeighborSet {
 public:
  PHI_HD void Add(int k) { AddIf(1, k); }
  // `bit`: 0 or 1.
  PHI_HD void AddIf(std::uint32_t bit, int k) {
    const auto place = static_cast<std::uint32_t>(k);
    words_[place / kBits] |= bit << place % kBits;
  }
  PHI_HD bool Contains(int k) const { return (words_[k / kBits] >> k % kBits & 1u) != 0; }
  // function(k) for each, ascending.
  template <typename Function>
  void ForEach(const Function& function) const {
    for (int first = 0; const std::uint32_t word : words_) {
      for (std::uint32_t rest = word; rest != 0; rest &= rest - 1) function(first + std::countr_zero(rest));
      first += static_cast<int>(kBits);
    }
  }
  bool operator==(const NeighborSet&) const = default;

 private:
  static constexpr std::uint32_t kBits = 32;
  static_assert(kMaxFusionNeighbors % kBits == 0);
  std::uint32_t words_[kMaxFusionNeighbors / kBits] = {};
};

}  // namespace phi
