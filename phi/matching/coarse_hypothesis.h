// The first hypothesis of a pixel from an estimate of the reduced image.
#pragma once

#include "phi/base/array2d.h"
#include "phi/base/hd.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/matching/estimate_pixel.h"

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
  const PlaneHypothesis& from = coarse.map(column, row);
  // The coarse pixel's centre in the fine image: K halves exactly.
  const float size = static_cast<float>(1 << coarse.shift);
  const float u = (column + 0.5f) * size, v = (row + 0.5f) * size;
  hypothesis->normal = from.normal;
  hypothesis->depth = PlaneDepthAt(p.reference, from, u, v, x + 0.5f, y + 0.5f);
  return p.IsInRange(hypothesis->depth) && FacesCamera(from.normal, p.reference.Ray(x + 0.5f, y + 0.5f));
}

}  // namespace phi
