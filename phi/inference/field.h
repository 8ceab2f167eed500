// The Markov random field over an image's holes: half-size, 4-connected, at most 4 labels a node.
#pragma once

#include <vector>

#include "phi/inference/hypothesis_matcher.h"
#include "phi/inference/potential_tables.h"
#include "phi/inference/trws_node.h"
#include "phi/options.h"

namespace phi {

// Nodes are the holes among the pixels (2 i, 2 j) that have a hypothesis. Measured neighbours have a single label, so
// their edges are part of the unary energies. A missing direction is a forbidden label.
class Field {
 public:
  Field(const HypothesisMatcher& matcher, const InferenceOptions& options);

  FieldView view() const;
  // The counts of nodes and of holes that are none.
  const FieldStatistics& counts() const { return counts_; }
  // Per node the inverse depth of its label; measured pixels keep theirs; 0 where there was no hypothesis.
  Array2D<float> ChosenInverseDepth(const std::vector<std::uint8_t>& labels) const;

 private:
  void SetNode(int i, int j, const FieldNode& node);

  int width_, height_;
  FieldStatistics counts_;
  PotentialTables potentials_;
  Array2D<float> unlabelled_;  // FieldNode's
  std::vector<std::uint8_t> allowed_;
  std::vector<float> inverse_depth_;  // kMaxLabels per node
  std::vector<std::int32_t> unary_;   // kMaxLabels per node
};

}  // namespace phi
