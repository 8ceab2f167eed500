// Pixels of an image, each of which stands for the cell around it.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "phi/inference/anchor_cells.h"

namespace phi {

struct Spot {
  int x, y;
};

// The least box around places; array indices.
struct SpotBox {
  float left = std::numeric_limits<float>::infinity(), top = left, right = -left, bottom = -left;

  bool IsEmpty() const { return !(left <= right); }
  bool Meets(const SpotBox& other) const {
    return left <= other.right && other.left <= right && top <= other.bottom && other.top <= bottom;
  }

  void Add(float x, float y) {
    left = std::min(left, x), right = std::max(right, x);
    top = std::min(top, y), bottom = std::max(bottom, y);
  }
  // All that a spot of a SpotGrid stands for. Pixel i reaches from i - 0.5 to i + 0.5.
  void AddCell(int column, int row, int step) {
    Add(static_cast<float>(column * step) - 0.5f, static_cast<float>(row * step) - 0.5f);
    Add(static_cast<float>((column + 1) * step) - 0.5f, static_cast<float>((row + 1) * step) - 0.5f);
  }
};

// Spots of one image, a cell's side apart in each direction.
struct SpotGrid {
  int step, columns, rows;

  SpotGrid(int width, int height)
      : step(static_cast<int>(std::lround(CellSide(width)))),
        columns((width + step - 1) / step),
        rows((height + step - 1) / step),
        width_(width),
        height_(height) {}

  Spot At(int column, int row) const {
    return {std::min(column * step + step / 2, width_ - 1), std::min(row * step + step / 2, height_ - 1)};
  }
  // Of one of its spots.
  int ColumnOf(const Spot& spot) const { return spot.x / step; }
  int RowOf(const Spot& spot) const { return spot.y / step; }

 private:
  int width_, height_;
};

}  // namespace phi
