// Runs TRW-S over a whole field, in parallel, with exactly the sequential order's result.
#pragma once

#include <vector>

#include "phi/inference/trws_node.h"

namespace phi {

struct TrwsResult {
  std::vector<std::uint8_t> labels;         // per node; kNoLabel outside the field
  std::int64_t energy = 0;                  // of `labels`, in units of 1 / kEnergyUnitsPerNat
  std::vector<std::int64_t> pass_energies;  // of each pass's own labels
  std::vector<std::int64_t> lower_bounds;   // after each pass; never falls
};

// `field`: allowed, inverse_depth, unary and potentials; its message and label arrays are not used. Returns the labels
// of the pass with the lowest energy, the first among equals. num_passes >= 1: forward and backward sweeps.
TrwsResult SolveTrws(FieldView field, int num_passes);

// Energy of any labelling of the field.
std::int64_t FieldEnergy(FieldView field, const std::vector<std::uint8_t>& labels);

// Each node's label of lowest unary energy, ties to the lowest label.
std::vector<std::uint8_t> MinUnaryLabels(const FieldView& field);

}  // namespace phi
