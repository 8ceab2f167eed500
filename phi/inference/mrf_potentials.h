// Potentials of the field (the paper's Eq. 6 and 7) as integer energies: negative logarithms, quantised.
//
// Costs and relative depth differences are rounded to 1 / 4096 and the logarithms are looked up in tables that the
// host computes once, so energies, messages and therefore labels are the same on every backend and for any number of
// threads.
#pragma once

#include <cmath>
#include <cstdint>

#include "phi/base/hd.h"
#include "phi/matching/zncc.h"

namespace phi {

inline constexpr int kEnergyUnitsPerNat = 4096;
inline constexpr double kNatsPerEnergyUnit = 1.0 / kEnergyUnitsPerNat;
inline constexpr int kPotentialSteps = 4096;  // table steps per unit of cost or relative difference
inline constexpr int kUnaryTableSize = static_cast<int>(kMaxCost) * kPotentialSteps + 1;  // costs in [0, kMaxCost]
inline constexpr int kPairwiseTableSize = kPotentialSteps + 1;   // relative differences in [0, 1]
// The most that the differences in [0, 1] may cost, so that 16 bits hold it.
inline constexpr double kMaxPairwiseNats = 15;

// Views of the two tables, trivially copyable to a device (see PotentialTables for the owner).
struct PotentialView {
  const std::int32_t* unary = nullptr;     // kUnaryTableSize
  const std::int32_t* pairwise = nullptr;  // kPairwiseTableSize
};

// Energy of a matching cost in [0, kMaxCost]; 0 for a perfect match. A cost that is not a number counts as kMaxCost.
PHI_HD std::int32_t UnaryEnergy(const PotentialView& potentials, float cost) {
  const float clamped = cost >= 0 ? (cost <= kMaxCost ? cost : kMaxCost) : (cost < 0 ? 0.0f : kMaxCost);
  return potentials.unary[static_cast<int>(rintf(clamped * kPotentialSteps))];
}

// Of two neighbouring nodes' depths or, equally, inverse depths (> 0), by their difference relative to the smaller one.
PHI_HD std::int32_t PairwiseEnergy(const PotentialView& potentials, float depth1, float depth2) {
  const float lo = depth1 < depth2 ? depth1 : depth2, hi = depth1 < depth2 ? depth2 : depth1;
  const float relative = (hi - lo) / lo;
  const float clamped = relative < 1 ? relative : 1.0f;
  return potentials.pairwise[static_cast<int>(rintf(clamped * kPotentialSteps))];
}

}  // namespace phi
