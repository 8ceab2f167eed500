// Owner of the potentials' tables.
#pragma once

#include <vector>

#include "phi/inference/mrf_potentials.h"
#include "phi/options.h"

namespace phi {

class PotentialTables {
 public:
  // Throws UsageError where the options' Check() tells a problem.
  explicit PotentialTables(const InferenceOptions& options);

  PotentialView view() const { return {unary_.data(), pairwise_.data()}; }
  const std::vector<std::int32_t>& unary() const { return unary_; }
  const std::vector<std::int32_t>& pairwise() const { return pairwise_; }

 private:
  std::vector<std::int32_t> unary_, pairwise_;
};

}  // namespace phi
