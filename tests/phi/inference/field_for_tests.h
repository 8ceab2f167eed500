// Small fields with random energies, and exact or independent solvers to compare TRW-S with.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "phi/inference/potential_tables.h"
#include "phi/inference/trws.h"

namespace phi {

class FieldForTests {
 public:
  // All labels of all nodes allowed; unary energies uniform in [0, 1) nat, inverse depths uniform in [1, 2).
  FieldForTests(int width, int height, unsigned seed)
      : potentials_(InferenceOptions()), width_(width), height_(height) {
    std::mt19937 random(seed);
    const std::size_t n = static_cast<std::size_t>(width) * height;
    allowed.assign(n, 15);
    for (std::size_t i = 0; i < kMaxLabels * n; ++i) {
      inverse_depth.push_back(1 + static_cast<float>(random() % 1000) / 1000);
      unary.push_back(static_cast<std::int32_t>(random() % kEnergyUnitsPerNat));
    }
  }

  FieldView view() const {
    FieldView view;
    view.width = width_;
    view.height = height_;
    view.potentials = potentials_.view();
    view.allowed = allowed.data();
    view.inverse_depth = inverse_depth.data();
    view.unary = unary.data();
    return view;
  }

  std::vector<std::uint8_t> allowed;
  std::vector<float> inverse_depth;
  std::vector<std::int32_t> unary;

 private:
  PotentialTables potentials_;
  int width_, height_;
};

// Calls visit(labels) for every labelling of the nodes [first, last), the others as they are.
template <typename Visit>
void ForEachLabelling(const FieldView& field, std::size_t first, std::size_t last,
                      std::vector<std::uint8_t>* labels, const Visit& visit) {
  if (first == last) {
    visit();
    return;
  }
  if (field.allowed[first] == 0) {
    (*labels)[first] = kNoLabel;
    ForEachLabelling(field, first + 1, last, labels, visit);
    return;
  }
  for (int k = 0; k < kMaxLabels; ++k) {
    if (!(field.allowed[first] >> k & 1)) continue;
    (*labels)[first] = static_cast<std::uint8_t>(k);
    ForEachLabelling(field, first + 1, last, labels, visit);
  }
}

inline std::int64_t BruteForceOptimum(const FieldView& field) {
  const std::size_t n = static_cast<std::size_t>(field.width) * field.height;
  std::vector<std::uint8_t> labels(n, kNoLabel);
  std::int64_t best = INT64_MAX;
  ForEachLabelling(field, 0, n, &labels, [&] { best = std::min(best, FieldEnergy(field, labels)); });
  return best;
}

// Exact for any height: dynamic programming over rows, whose states are all labellings of a row.
inline std::int64_t RowProgrammingOptimum(const FieldView& field) {
  struct State {
    std::vector<std::uint8_t> labels;
    std::int64_t best;
  };
  std::vector<State> above;
  const std::size_t w = static_cast<std::size_t>(field.width);
  for (int y = 0; y < field.height; ++y) {
    std::vector<State> states;
    std::vector<std::uint8_t> labels(w * field.height, kNoLabel);
    ForEachLabelling(field, y * w, (y + 1) * w, &labels, [&] {
      State state{{labels.begin() + y * w, labels.begin() + (y + 1) * w}, 0};
      std::int64_t own = 0;
      FieldView f = field;
      f.label = labels.data();
      for (int x = 0; x < field.width; ++x) {
        const std::int64_t node = NodeIndex(f, x, y);
        if (!InField(f, x, y)) continue;
        own += f.unary[kMaxLabels * node + labels[node]];
        if (InField(f, x + 1, y)) own += LabelEnergy(f, node, labels[node], node + 1);
      }
      state.best = y == 0 ? own : INT64_MAX;
      for (const State& previous : above) {
        std::copy(previous.labels.begin(), previous.labels.end(), labels.begin() + (y - 1) * w);
        std::int64_t energy = own + previous.best;
        for (int x = 0; x < field.width; ++x) {
          if (!InField(f, x, y) || !InField(f, x, y - 1)) continue;
          const std::int64_t node = NodeIndex(f, x, y);
          energy += LabelEnergy(f, node, labels[node], node - f.width);
        }
        state.best = std::min(state.best, energy);
      }
      states.push_back(state);
    });
    above = states;
  }
  std::int64_t best = INT64_MAX;
  for (const State& state : above) best = std::min(best, state.best);
  return best;
}

// Loopy min-sum belief propagation: all messages at once, `iterations` times; the lowest energy met.
inline std::int64_t BeliefPropagationEnergy(const FieldView& field, int iterations) {
  constexpr int kSteps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};  // step s ^ 1 is the opposite of step s
  const std::size_t n = static_cast<std::size_t>(field.width) * field.height;
  std::vector<std::int64_t> messages(n * 4 * kMaxLabels, 0);  // [node][step it came along][label]
  std::int64_t best = INT64_MAX;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    std::vector<std::int64_t> next(messages.size(), 0);
    std::vector<std::uint8_t> labels(n, kNoLabel);
    for (int y = 0; y < field.height; ++y) {
      for (int x = 0; x < field.width; ++x) {
        if (!InField(field, x, y)) continue;
        const std::int64_t node = NodeIndex(field, x, y);
        std::int64_t belief[kMaxLabels];
        int arg = -1;
        for (int k = 0; k < kMaxLabels; ++k) {
          belief[k] = field.unary[kMaxLabels * node + k];
          for (int s = 0; s < 4; ++s) belief[k] += messages[(node * 4 + s) * kMaxLabels + k];
          if ((field.allowed[node] >> k & 1) && (arg < 0 || belief[k] < belief[arg])) arg = k;
        }
        labels[node] = static_cast<std::uint8_t>(arg);
        for (int s = 0; s < 4; ++s) {
          if (!InField(field, x + kSteps[s][0], y + kSteps[s][1])) continue;
          const std::int64_t to = NodeIndex(field, x + kSteps[s][0], y + kSteps[s][1]);
          std::int64_t lowest = INT64_MAX;
          for (int j = 0; j < kMaxLabels; ++j) {
            if (!(field.allowed[to] >> j & 1)) continue;
            std::int64_t message = INT64_MAX;
            for (int i = 0; i < kMaxLabels; ++i) {
              if (!(field.allowed[node] >> i & 1)) continue;
              message = std::min<std::int64_t>(
                  message, belief[i] - messages[(node * 4 + (s ^ 1)) * kMaxLabels + i] +
                               PairwiseEnergy(field.potentials, field.inverse_depth[kMaxLabels * node + i],
                                              field.inverse_depth[kMaxLabels * to + j]));
            }
            next[(to * 4 + s) * kMaxLabels + j] = message;
            lowest = std::min(lowest, message);
          }
          for (int j = 0; j < kMaxLabels; ++j) next[(to * 4 + s) * kMaxLabels + j] -= lowest;
        }
      }
    }
    best = std::min(best, FieldEnergy(field, labels));
    messages = next;
  }
  return best;
}

}  // namespace phi
