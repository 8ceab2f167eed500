// Pixels of an image, each of which stands for the cell around it.
#pragma once

#include <algorithm>
#include <cmath>

#include "phi/inference/anchor_cells.h"

namespace phi {

struct Spot {
  int x, y;
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

 private:
  int width_, height_;
};

}  // namespace phi
