// Max-product tree-reweighted message passing, sequential (Kolmogorov, "Convergent tree-reweighted message passing for
// energy minimization", PAMI 2006), on a 4-connected grid with at most 4 labels a node and integer energies.
//
// The trees are the field's horizontal and vertical runs. A node that lies on two shares its energy between them; both
// shares are integers (floor and ceiling), so messages, lower bound and labels are exact numbers: they do not depend on
// the backend or on the number of threads. The lower bound never falls from pass to pass, because min(floor) +
// min(ceiling) = min of the whole >= the sum of the minima before.
#pragma once

#include <cstdint>

#include "phi/inference/mrf_potentials.h"

namespace phi {

inline constexpr int kMaxLabels = 4;

// Arrays of one entry, or kMaxLabels entries, per node; node (x, y) has index y * width + x. The functions below take any
// type with these members but for potentials and inverse_depth, which EdgeEnergy hides.
struct FieldView {
  int width = 0, height = 0;
  PotentialView potentials;
  const std::uint8_t* allowed =
      nullptr;                           // bit k: label k may be chosen; 0: the node is not part of the field
  const float* inverse_depth = nullptr;  // per label, > 0 where allowed
  const std::int32_t* unary = nullptr;   // per label
  // Message on the edge to the right / lower neighbour, in the direction in which it was last sent; starts at 0.
  std::int32_t* horizontal = nullptr;  // per label of the receiving node
  std::int32_t* vertical = nullptr;
  std::uint8_t* label = nullptr;  // of the last decoding; kNoLabel outside the field

  // Of label i of node `from` beside label j of its neighbour `to`; some number where one of them is not allowed.
  PHI_HD std::int32_t EdgeEnergy(std::int64_t from, int i, std::int64_t to, int j) const {
    return PairwiseEnergy(potentials, inverse_depth[kMaxLabels * from + i],
                          inverse_depth[kMaxLabels * to + j]);
  }
  // Whether a branch is cheaper than the energy of an edge.
  static constexpr bool kSkipsForbidden = true;
};

inline constexpr std::uint8_t kNoLabel = 255;

template <typename Field>
PHI_HD std::int64_t NodeIndex(const Field& f, int x, int y) {
  return static_cast<std::int64_t>(y) * f.width + x;
}
template <typename Field>
PHI_HD bool InField(const Field& f, int x, int y) {
  return x >= 0 && y >= 0 && x < f.width && y < f.height && f.allowed[NodeIndex(f, x, y)] != 0;
}

inline constexpr std::int32_t kNoEnergy = 0x7FFFFFFF;  // above that of any label

// The message that node `from` with the energies `energy` (its share less what came from `to`) sends to node `to`.
template <typename Field>
PHI_HD void SendMessage(const Field& f, std::int64_t from, std::int64_t to, const std::int32_t* energy,
                        std::int32_t* message) {
  const std::uint8_t allowed = f.allowed[from], allowed_to = f.allowed[to];
  std::int32_t sent[kMaxLabels];  // stored when all reads are done, so that they need not wait for each other
  for (int j = 0; j < kMaxLabels; ++j) {
    std::int32_t best = kNoEnergy;
    for (int i = 0; i < kMaxLabels; ++i) {
      if (Field::kSkipsForbidden && !(allowed >> i & allowed_to >> j & 1)) continue;
      const std::int32_t e = energy[i] + f.EdgeEnergy(from, i, to, j);
      best = (allowed >> i & 1) && e < best ? e : best;
    }
    sent[j] = allowed_to >> j & 1 ? best : 0;
  }
  for (int j = 0; j < kMaxLabels; ++j) message[j] = sent[j];
}

// Smallest of the allowed entries, and its lowest index.
PHI_HD int ArgMin(const std::int32_t* energy, std::uint8_t allowed) {
  int best = -1;
  std::int32_t least = kNoEnergy;
  for (int k = 0; k < kMaxLabels; ++k) {
    const bool better = (allowed >> k & 1) && energy[k] < least;
    best = better ? k : best;
    least = better ? energy[k] : least;
  }
  return best;
}

PHI_HD std::int32_t Least(const std::int32_t* energy, std::uint8_t allowed) {
  std::int32_t least = kNoEnergy;
  for (int k = 0; k < kMaxLabels; ++k) {
    least = (allowed >> k & 1) && energy[k] < least ? energy[k] : least;
  }
  return least;
}

// Averages the node's share of its row and column runs and sends messages ahead: right and down if forward, left and
// up if not. Nodes must come in raster order (forward) or its reverse, or any order that keeps each node after its two
// predecessors, such as anti-diagonals. Returns what the node adds to the lower bound of this sweep.
template <typename Field>
PHI_HD std::int64_t UpdateNode(const Field& f, int x, int y, bool forward) {
  const std::int64_t node = NodeIndex(f, x, y);
  const std::uint8_t allowed = f.allowed[node];
  if (allowed == 0) return 0;
  const bool left = InField(f, x - 1, y), right = InField(f, x + 1, y);
  const bool up = InField(f, x, y - 1), down = InField(f, x, y + 1);
  std::int32_t* to_left = f.horizontal + kMaxLabels * (node - 1);
  std::int32_t* to_right = f.horizontal + kMaxLabels * node;
  std::int32_t* to_up = f.vertical + kMaxLabels * (node - f.width);
  std::int32_t* to_down = f.vertical + kMaxLabels * node;
  const bool in_row = left || right, in_column = up || down;
  std::int32_t row[kMaxLabels] = {}, column[kMaxLabels] = {};
  for (int k = 0; k < kMaxLabels; ++k) {
    std::int32_t sum = f.unary[kMaxLabels * node + k];
    if (left) sum += to_left[k];
    if (right) sum += to_right[k];
    if (up) sum += to_up[k];
    if (down) sum += to_down[k];
    row[k] = in_row && in_column ? sum >> 1 : sum;  // >> rounds down, also below zero
    column[k] = in_row ? sum - row[k] : sum;
  }
  const bool row_goes_on = forward ? right : left, column_goes_on = forward ? down : up;
  std::int64_t bound = 0;
  if (in_row && !row_goes_on) bound += Least(row, allowed);
  if ((in_column && !column_goes_on) || (!in_row && !in_column)) bound += Least(column, allowed);
  if (row_goes_on) {
    std::int32_t* message = forward ? to_right : to_left;
    for (int k = 0; k < kMaxLabels; ++k) row[k] -= message[k];
    SendMessage(f, node, forward ? node + 1 : node - 1, row, message);
  }
  if (column_goes_on) {
    std::int32_t* message = forward ? to_down : to_up;
    for (int k = 0; k < kMaxLabels; ++k) column[k] -= message[k];
    SendMessage(f, node, forward ? node + f.width : node - f.width, column, message);
  }
  return bound;
}

template <typename Field>
PHI_HD std::int32_t LabelEnergy(const Field& f, std::int64_t node, int k, std::int64_t neighbour) {
  return f.EdgeEnergy(node, k, neighbour, f.label[neighbour]);
}

// Chooses the node's label in the backward sweep, before UpdateNode: right and lower neighbours have theirs, the
// others speak through their forward messages. Ties go to the lowest label.
template <typename Field>
PHI_HD void DecodeNode(const Field& f, int x, int y) {
  const std::int64_t node = NodeIndex(f, x, y);
  const std::uint8_t allowed = f.allowed[node];
  if (allowed == 0) {
    f.label[node] = kNoLabel;
    return;
  }
  const bool left = InField(f, x - 1, y), right = InField(f, x + 1, y);
  const bool up = InField(f, x, y - 1), down = InField(f, x, y + 1);
  std::int32_t energy[kMaxLabels] = {};
  for (int k = 0; k < kMaxLabels; ++k) {
    if (Field::kSkipsForbidden && !(allowed >> k & 1)) continue;
    energy[k] = f.unary[kMaxLabels * node + k];
    if (left) energy[k] += f.horizontal[kMaxLabels * (node - 1) + k];
    if (up) energy[k] += f.vertical[kMaxLabels * (node - f.width) + k];
    if (right) energy[k] += LabelEnergy(f, node, k, node + 1);
    if (down) energy[k] += LabelEnergy(f, node, k, node + f.width);
  }
  f.label[node] = static_cast<std::uint8_t>(ArgMin(energy, allowed));
}

// Energy of the node and of its edges to the right and down, for the labels in f.label.
template <typename Field>
PHI_HD std::int64_t NodeEnergy(const Field& f, int x, int y) {
  const std::int64_t node = NodeIndex(f, x, y);
  if (f.allowed[node] == 0) return 0;
  const int k = f.label[node];
  std::int64_t energy = f.unary[kMaxLabels * node + k];
  if (InField(f, x + 1, y)) energy += LabelEnergy(f, node, k, node + 1);
  if (InField(f, x, y + 1)) energy += LabelEnergy(f, node, k, node + f.width);
  return energy;
}

}  // namespace phi
