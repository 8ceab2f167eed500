#include "phi/inference/potential_tables.h"

#include <algorithm>
#include <string>

#include "phi/base/error.h"

namespace phi {
namespace {

std::int32_t Quantise(double nats) {
  return static_cast<std::int32_t>(std::lround(nats * kEnergyUnitsPerNat));
}

}  // namespace

PotentialTables::PotentialTables(const InferenceOptions& options)
    : unary_(kUnaryTableSize), pairwise_(kPairwiseTableSize) {
  if (const std::string problem = options.Check(); !problem.empty()) throw UsageError(problem);
  const double best_unary = kMaxCost / options.kappa1 + options.kappa2;
  for (int i = 0; i < kUnaryTableSize; ++i) {
    const double cost = static_cast<double>(i) / kPotentialSteps;
    unary_[i] = Quantise(-std::log(((kMaxCost - cost) / options.kappa1 + options.kappa2) / best_unary));
  }
  for (int i = 0; i < kPairwiseTableSize; ++i) {
    const double difference = std::min(options.truncation, static_cast<double>(i) / kPotentialSteps);
    pairwise_[i] = Quantise(-2 * std::log((options.kappa3 - difference) / options.kappa3));
  }
}

}  // namespace phi
