#include "phi/inference/sky_rims.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include <tbb/parallel_for.h>

#include "phi/inference/pooled_anchors.h"

namespace phi {
namespace {

// Pixels. What has texture of its own lies up to three from an edge (own_texture.h); the sky must be open a pixel or two beyond it.
constexpr int kRimReach = 5;

struct SkyBeside {
  const RegionPlanes& planes;
  const GrayImage& image;
  const StateMap& states;  // before any was dropped
  int max_change;          // grey levels

  // Whether the pixel's region, without a depth, is as bright near it.
  bool IsShown(int x, int y) const {
    const std::int32_t region = planes.RegionAt(x, y);
    const int own = image(x, y);
    for (int v = std::max(y - kRimReach, 0); v <= std::min(y + kRimReach, image.height() - 1); ++v) {
      for (int u = std::max(x - kRimReach, 0); u <= std::min(x + kRimReach, image.width() - 1); ++u) {
        if (planes.RegionAt(u, v) != region || IsPublished(states(u, v))) continue;
        if (std::abs(image(u, v) - own) <= max_change) return true;
      }
    }
    return false;
  }
};

}  // namespace

void DropSkyRims(const RegionPlanes& planes, const GrayImage& image, const Rules& rules, MeasurementMap* map) {
  if (!rules.IsOn(Rule::kSkyRims) || !planes.ShowsSky()) return;
  const StateMap states = map->states;
  const SkyBeside sky = {planes, image, states, static_cast<int>(rules.Factor(Rule::kSkyRims) * kMaxBrightnessChange)};
  tbb::parallel_for(0, map->height(), [&](int y) {
    planes.ForFittedRuns(y, [&](int begin, int end, const FittedRegion& region) {
      if (region.sky != Sky::kSeen) return;
      for (int x = begin; x < end; ++x) {
        if (!IsPublished(states(x, y)) || !sky.IsShown(x, y)) continue;
        map->Drop(static_cast<std::size_t>(y) * static_cast<std::size_t>(map->width()) + static_cast<std::size_t>(x));
      }
    });
  });
}

}  // namespace phi
