#include "phi/inference/trws.h"

#include <algorithm>
#include <atomic>

#include <tbb/parallel_for.h>

namespace phi {
namespace {

// Tiles on one anti-diagonal depend only on tiles of the diagonals before it; inside a tile nodes go in raster order.
// Every node therefore sees its neighbours in the state that the sequential raster order gives them.
constexpr int kTileSize = 64;

struct Tile {
  int x0, y0, x1, y1;
};

// Calls visit(tile) for all tiles, diagonal by diagonal, from the top left (forward) or the bottom right.
template <typename Visit>
void ForEachTileInWavefront(const FieldView& field, bool forward, const Visit& visit) {
  const int columns = (field.width + kTileSize - 1) / kTileSize,
            rows = (field.height + kTileSize - 1) / kTileSize;
  const int num_diagonals = columns + rows - 1;
  for (int i = 0; i < num_diagonals; ++i) {
    const int diagonal = forward ? i : num_diagonals - 1 - i;
    const int first = std::max(0, diagonal - columns + 1), last = std::min(rows - 1, diagonal);
    tbb::parallel_for(first, last + 1, [&](int row) {
      const int x0 = (diagonal - row) * kTileSize, y0 = row * kTileSize;
      visit(Tile{x0, y0, std::min(x0 + kTileSize, field.width), std::min(y0 + kTileSize, field.height)});
    });
  }
}

void SweepForward(const FieldView& field) {
  ForEachTileInWavefront(field, true, [&](const Tile& tile) {
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) UpdateNode(field, x, y, true);
    }
  });
}

// Decodes, updates, and returns the lower bound.
std::int64_t SweepBackward(const FieldView& field) {
  std::atomic<std::int64_t> bound{0};  // a sum of integers: the same in any order
  ForEachTileInWavefront(field, false, [&](const Tile& tile) {
    std::int64_t sum = 0;
    for (int y = tile.y1 - 1; y >= tile.y0; --y) {
      for (int x = tile.x1 - 1; x >= tile.x0; --x) {
        DecodeNode(field, x, y);
        sum += UpdateNode(field, x, y, false);
      }
    }
    bound += sum;
  });
  return bound;
}

std::int64_t Energy(const FieldView& field) {
  std::int64_t energy = 0;
  for (int y = 0; y < field.height; ++y) {
    for (int x = 0; x < field.width; ++x) energy += NodeEnergy(field, x, y);
  }
  return energy;
}

}  // namespace

TrwsResult SolveTrws(FieldView field, int num_passes) {
  const std::size_t n = static_cast<std::size_t>(field.width) * field.height;
  std::vector<std::int32_t> horizontal(kMaxLabels * n, 0), vertical(kMaxLabels * n, 0);
  std::vector<std::uint8_t> labels(n, kNoLabel);
  field.horizontal = horizontal.data();
  field.vertical = vertical.data();
  field.label = labels.data();
  TrwsResult result;
  for (int pass = 0; pass < num_passes; ++pass) {
    SweepForward(field);
    result.lower_bounds.push_back(SweepBackward(field));
    result.pass_energies.push_back(Energy(field));
    if (pass == 0 || result.pass_energies.back() < result.energy) {
      result.energy = result.pass_energies.back();
      result.labels = labels;
    }
    if (result.lower_bounds.back() == result.energy) break;  // optimal
  }
  return result;
}

std::int64_t FieldEnergy(FieldView field, const std::vector<std::uint8_t>& labels) {
  std::vector<std::uint8_t> copy = labels;
  field.label = copy.data();
  return Energy(field);
}

std::vector<std::uint8_t> MinUnaryLabels(const FieldView& field) {
  std::vector<std::uint8_t> labels(static_cast<std::size_t>(field.width) * field.height, kNoLabel);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (field.allowed[i] != 0) {
      labels[i] = static_cast<std::uint8_t>(ArgMin(field.unary + kMaxLabels * i, field.allowed[i]));
    }
  }
  return labels;
}

}  // namespace phi
