// From the half-size field to full size: each pixel takes the one of its own hypotheses that is nearest to what the
// field chose beside it. Depths are never blended, so nothing lies between two surfaces.
#pragma once

#include <cmath>
#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/inference/line_hypothesis.h"

namespace phi {

// Inverse depths of the hypotheses, one map per direction; measured pixels hold their own in all of them.
struct HypothesisMaps {
  ArrayView2D<const float> inverse_depth[kNumDirections];
};

// Node (i, j) of the field is pixel (2 i, 2 j).
inline constexpr int kFieldStride = 2;
// Nodes in so many pixels of a row or a column.
constexpr int NumNodesAlong(int num_pixels) { return (num_pixels + kFieldStride - 1) / kFieldStride; }

// The index of the pixel's hypothesis nearest to `reference` (inverse depth; paper: nearest in depth), ties to the lowest;
// -1 = it has none.
PHI_HD int NearestHypothesis(const HypothesisMaps& maps, Formulas formulas, int x, int y, float reference) {
  int best = -1;
  float best_difference = 0;
  for (int k = 0; k < kNumDirections; ++k) {
    const float w = maps.inverse_depth[k](x, y);
    if (!(w > 0)) continue;
    float difference = fabsf(w - reference);
    if (formulas == Formulas::kPaper) difference /= w;  // |z - z'| = z' |w - w'| / w, z' the same for all
    if (best < 0 || difference < best_difference) {
      best = k;
      best_difference = difference;
    }
  }
  return best;
}

// The index of pixel (x, y)'s hypothesis, from the chosen inverse depths of the field's nodes (0 = none); -1 = stays a
// hole. The pixel's own node speaks first, then the other nodes around it.
PHI_HD int UpsampleHypothesis(const HypothesisMaps& maps, ArrayView2D<const float> chosen, Formulas formulas,
                              int x, int y) {
  for (int neighbour = 0; neighbour < 4; ++neighbour) {
    const int i = x / kFieldStride + (neighbour & 1), j = y / kFieldStride + (neighbour >> 1);
    if (!chosen.Contains(i, j) || !(chosen(i, j) > 0)) continue;
    return NearestHypothesis(maps, formulas, x, y, chosen(i, j));
  }
  return -1;
}

}  // namespace phi
