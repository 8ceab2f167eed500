// Red-black propagation with adaptive sampling (paper section C, after Xu and Tao, CVPR 2019).
//
// Around a pixel lie eight sectors (the paper's regions), four near V shapes and four far strips, made of pixels
// of the other colour only. Each sector sends the hypothesis of its pixel with the lowest cost.
#pragma once

#include "phi/base/array2d.h"
#include "phi/base/hd.h"

namespace phi {

inline constexpr int kNumSectors = 8;
inline constexpr int kNearSamples = 7;                               // of a V shape
inline constexpr int kFarSamples = 11;                               // of a strip
inline constexpr int kPropagationReach = 3 + 2 * (kFarSamples - 1);  // rows or columns to the farthest sample

struct PixelOffset {
  int dx = 0, dy = 0;
};

// Rotates an offset that was given for the direction 'up' by 0, 90, 180 or 270 degrees.
PHI_HD PixelOffset RotateOffset(int right, int up, int direction) {
  switch (direction) {
    case 0:
      return {right, -up};
    case 1:
      return {up, right};
    case 2:
      return {-right, up};
    default:
      return {-up, -right};
  }
}

// Sectors 0-3 are near, 4-7 far. |dx| + |dy| is odd for all of them: the other colour of the checkerboard.
PHI_HD int NumSectorSamples(int sector) { return sector < 4 ? kNearSamples : kFarSamples; }

PHI_HD PixelOffset SectorOffset(int sector, int sample) {
  if (sector >= 4) return RotateOffset(0, 3 + 2 * sample, sector - 4);
  const int arm = (sample + 1) / 2;  // 0, 1, 1, 2, 2, 3, 3
  return RotateOffset(sample & 1 ? arm : -arm, arm + 1, sector);
}

// The pixel of `sector` with the lowest cost, the first one on ties. False when the sector lies outside the
// image.
PHI_HD bool BestInSector(ArrayView2D<const float> cost, int x, int y, int sector, PixelOffset* best) {
  bool found = false;
  float lowest = 0;
  for (int sample = 0; sample < NumSectorSamples(sector); ++sample) {
    const PixelOffset o = SectorOffset(sector, sample);
    if (!cost.Contains(x + o.dx, y + o.dy)) continue;
    const float c = cost(x + o.dx, y + o.dy);
    if (found && !(c < lowest)) continue;
    found = true;
    lowest = c;
    *best = o;
  }
  return found;
}

}  // namespace phi
