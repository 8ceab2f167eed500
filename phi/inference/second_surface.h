// Whether a region's second plane is a surface of its own.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "phi/inference/image_plane.h"

namespace phi {

// How far the planes differ where the second one's anchors lie, relative to it. The second has anchors.
template <typename Anchor>
double Apart(const std::vector<Anchor>& anchors, const ImagePlane& first, const ImagePlane& second) {
  double x = 0, y = 0;
  int n = 0;
  for (const Anchor& p : anchors) {
    if (!IsOn(second, p)) continue;
    x += p.x, y += p.y, ++n;
  }
  x /= n, y /= n;
  const double w = second.InverseDepth(x, y);
  return std::abs(first.InverseDepth(x, y) - w) / w;
}

// How far before the first plane, relative to its depth, nine in ten of the second one's anchors lie at least; 0 without
// anchors.
template <typename Anchor>
double DetachedBy(const std::vector<Anchor>& anchors, const ImagePlane& first, const ImagePlane& second) {
  std::vector<double> before;
  for (const Anchor& p : anchors) {
    if (IsOn(second, p)) before.push_back(p.w / first.InverseDepth(p.x, p.y) - 1);
  }
  if (before.empty()) return 0;
  const auto tenth = before.begin() + static_cast<std::ptrdiff_t>(before.size() / 10);
  std::nth_element(before.begin(), tenth, before.end());
  return *tenth;
}

// Noise of the first plane's anchors, or the rim of something that stands before the surface: seen in front of an even
// region, it would end in a step of brightness within. Where two walls meet, anchors lie at the crease too.
template <typename Anchor>
bool IsNoSecondSurface(const std::vector<Anchor>& anchors, const ImagePlane& first, const ImagePlane& second,
                       double min_apart) {
  return Apart(anchors, first, second) < min_apart || DetachedBy(anchors, first, second) > min_apart;
}

}  // namespace phi
