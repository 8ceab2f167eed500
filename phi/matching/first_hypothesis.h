// The hypothesis that a pixel starts with: that of an estimate of the reduced image, else a random one.
#pragma once

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/matching/depth_ranges.h"
#include "phi/matching/estimate_pixel.h"
#include "phi/matching/random_hypothesis.h"

namespace phi {

// An estimate of the image reduced by 2^shift; without data: none.
struct CoarseHypotheses {
  ArrayView2D<const PlaneHypothesis> map;
  int shift = 0;
};

// The plane of the coarse pixel that covers (x, y), moved along it to that pixel: planes stay exact. False when it leaves
// its domain there. p: of the fine image.
PHI_HD bool HypothesisFromCoarse(const EstimationParameters& p, const CoarseHypotheses& coarse, int x, int y,
                                 PlaneHypothesis* hypothesis) {
  const int column = x >> coarse.shift, row = y >> coarse.shift;
  // The coarse pixel's centre in the fine image: K halves exactly.
  const float size = static_cast<float>(1 << coarse.shift);
  const ImagePoint center = {(column + 0.5f) * size, (row + 0.5f) * size};
  return MovePlane(p, coarse.map(column, row), center, x, y, hypothesis);
}

// From the range of the sparse points around the pixel, or the view's range where that is unknown (too few points).
PHI_HD PlaneHypothesis DrawHypothesis(const EstimationParameters& p, DepthRange near, int x, int y) {
  const bool known = near.min > 0;
  const DepthRange range = {Clamp(known ? near.min : p.depth_min, p.nearest, p.farthest),
                            Clamp(known ? near.max : p.depth_max, p.nearest, p.farthest)};
  return RandomHypothesis(p.reference, x, y, range, p.key, p.method.FormulasOf(Rule::kFirstHypotheses));
}

PHI_HD PlaneHypothesis FirstHypothesis(const EstimationParameters& p, const CoarseHypotheses& coarse,
                                       const DepthRanges& ranges, int x, int y) {
  PlaneHypothesis hypothesis;
  if (coarse.map.data != nullptr && HypothesisFromCoarse(p, coarse, x, y, &hypothesis)) return hypothesis;
  return DrawHypothesis(p, ranges.At(x, y), x, y);
}

}  // namespace phi
