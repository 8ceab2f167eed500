// A tile of the field and the nodes around it in shared memory, for the functions of phi/inference/trws_node.h.
#pragma once

#include <type_traits>

#include "phi/inference/trws_node.h"

namespace phi::gpu {

inline constexpr int kTileRows = 32;  // as many as a warp has lanes
// With its margin a tile takes less than the 64 KiB that every device has, and its rows are 16 nodes apart: the lanes'
// 16-byte entries, one row and one column apart, then lie in different banks.
inline constexpr int kTileColumns = 14;
inline constexpr int kPairs = kMaxLabels * kMaxLabels;  // of labels, on an edge

// The tile's node (x, y) has the place (x + 1, y + 1).
class FieldTile {
 public:
  static constexpr int width = kTileColumns + 2, height = kTileRows + 2, kNumNodes = width * height;
  static constexpr bool kSkipsForbidden = false;  // reads wait for each other behind branches

  std::uint8_t* allowed;
  std::int32_t *unary, *horizontal, *vertical;  // as FieldView's
  std::uint8_t* label;

  // memory: kTileBytes. (first_x, first_y): the tile's first node.
  __device__ FieldTile(int4* memory, int first_x, int first_y) : first_x_(first_x), first_y_(first_y) {
    unary = reinterpret_cast<std::int32_t*>(memory);
    horizontal = unary + kMaxLabels * kNumNodes;
    vertical = horizontal + kMaxLabels * kNumNodes;
    edges_ = reinterpret_cast<std::uint16_t*>(vertical + kMaxLabels * kNumNodes);
    allowed = reinterpret_cast<std::uint8_t*>(edges_ + 2 * kPairs * kNumNodes);
    label = allowed + kNumNodes;
  }

  // Which nodes are part of the field; false where none of the tile's own is. By all threads of the block, as the
  // functions that follow.
  __device__ bool LoadAllowed(const FieldView& field) const {
    bool any = false;
    for (int node = threadIdx.x; node < kNumNodes; node += blockDim.x) {
      const int x = FieldX(node), y = FieldY(node);
      const bool in_field = x >= 0 && y >= 0 && x < field.width && y < field.height;
      allowed[node] = in_field ? field.allowed[NodeIndex(field, x, y)] : 0;
      any |= allowed[node] != 0 && IsOwn(node);
    }
    return __syncthreads_or(any);
  }

  __device__ void Load(const FieldView& field) const {
    for (int node = threadIdx.x; node < kNumNodes; node += blockDim.x) {
      if (allowed[node] == 0) continue;
      const std::int64_t from = NodeIndex(field, FieldX(node), FieldY(node));
      Entry(unary, node) = Entry(field.unary, from);
      Entry(horizontal, node) = Entry(field.horizontal, from);
      Entry(vertical, node) = Entry(field.vertical, from);
      label[node] = field.label[from];
      if (node % width + 1 < width) LoadEdge(field, node, node + 1, from, from + 1);
      if (node / width + 1 < height) LoadEdge(field, node, node + width, from, from + field.width);
    }
  }

  // What the sweep has changed: messages that were sent right and down, or left and up, and labels.
  template <bool kForward>
  __device__ void Store(const FieldView& field) const {
    for (int node = threadIdx.x; node < kNumNodes; node += blockDim.x) {
      if (!IsOwn(node) || allowed[node] == 0) continue;
      const std::int64_t to = NodeIndex(field, FieldX(node), FieldY(node));
      constexpr int kBack = kForward ? 0 : 1;  // an edge belongs to the node on its left or upper end
      if (kForward || allowed[node - 1] != 0)
        Entry(field.horizontal, to - kBack) = Entry(horizontal, node - kBack);
      if (kForward || allowed[node - width] != 0)
        Entry(field.vertical, to - kBack * field.width) = Entry(vertical, node - kBack * width);
      if (!kForward) field.label[to] = label[node];
    }
  }

  // As FieldView's, of neighbours in the tile.
  __device__ std::int32_t EdgeEnergy(std::int64_t from, int i, std::int64_t to, int j) const {
    const bool ahead = to > from, in_row = to - from == 1 || from - to == 1;
    const int pair = (in_row ? 0 : kPairs) + (ahead ? kMaxLabels * i + j : kMaxLabels * j + i);
    return edges_[pair * kNumNodes + (ahead ? from : to)];
  }

 private:
  template <typename Values, typename Index>
  __device__ static auto& Entry(Values* values, Index node) {
    static_assert(kMaxLabels == 4);
    using Vector = std::conditional_t<std::is_const_v<Values>, const int4, int4>;
    return reinterpret_cast<Vector*>(values)[node];
  }

  __device__ int FieldX(int node) const { return first_x_ + node % width - 1; }
  __device__ int FieldY(int node) const { return first_y_ + node / width - 1; }
  __device__ static bool IsOwn(int node) {
    const int x = node % width, y = node / width;
    return x > 0 && y > 0 && x + 1 < width && y + 1 < height;
  }

  // `from`, `to`: the ends' places in the field.
  __device__ void LoadEdge(const FieldView& field, int node, int neighbour, std::int64_t from,
                           std::int64_t to) const {
    if (allowed[neighbour] == 0) return;
    const int first_pair = neighbour == node + 1 ? 0 : kPairs;
    for (int i = 0; i < kMaxLabels; ++i) {
      for (int j = 0; j < kMaxLabels; ++j) {
        const std::int32_t energy = PairwiseEnergy(field.potentials, field.inverse_depth[kMaxLabels * from + i],
                                                   field.inverse_depth[kMaxLabels * to + j]);
        edges_[(first_pair + kMaxLabels * i + j) * kNumNodes + node] = static_cast<std::uint16_t>(energy);
      }
    }
  }

  // PairwiseEnergy of each pair of labels, of the edges to the right, then of those down, by the node they start from.
  std::uint16_t* edges_;
  int first_x_, first_y_;
};

// A label's energies and two messages, two edges, and two bytes.
inline constexpr int kTileBytes =
    FieldTile::kNumNodes * (3 * kMaxLabels * sizeof(std::int32_t) + 2 * kPairs * sizeof(std::uint16_t) + 2);
static_assert(kTileBytes <= 64 << 10 && kMaxPairwiseNats * kEnergyUnitsPerNat < 1 << 16);

// By one warp; `row`: its lane. Returns what the row adds to the lower bound.
template <bool kForward>
__device__ std::int64_t SweepTile(const FieldTile& tile, int row) {
  constexpr int kSteps = kTileColumns + kTileRows - 1;
  std::int64_t bound = 0;
  for (int step = 0; step < kSteps; ++step) {
    const int column = (kForward ? step : kSteps - 1 - step) - row;
    if (column >= 0 && column < kTileColumns) {
      if (!kForward) DecodeNode(tile, column + 1, row + 1);
      bound += UpdateNode(tile, column + 1, row + 1, kForward);
    }
    __syncwarp();  // orders the lanes' memory accesses, too
  }
  return bound;
}

}  // namespace phi::gpu
