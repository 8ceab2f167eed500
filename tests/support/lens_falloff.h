// What two images whose lenses darken their corners show of the same surfaces.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "phi/inference/relative_exposure.h"

namespace test_support {

// A lens darkens by the fourth power of the cosine of the angle whose tangent, squared, is `falloff` / 2 in the corner.
inline double Darkened(double squared_radius, double falloff) { return 1 / std::pow(1 + falloff / 2 * squared_radius, 2); }

// A surface of every brightness, seen at every place of two images, the reference `gain` times as long exposed.
inline std::vector<phi::SpotPair> SeenByBoth(int count, double gain, double reference_falloff, double source_falloff) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> brightness(40, 150), radius(0, 1);
  std::vector<phi::SpotPair> pairs;
  for (int i = 0; i < count; ++i) {
    const double surface = brightness(random), here = radius(random), there = radius(random);
    pairs.push_back({{static_cast<float>(gain * surface * Darkened(here, reference_falloff)), static_cast<float>(here)},
                     {static_cast<float>(surface * Darkened(there, source_falloff)), static_cast<float>(there)}});
  }
  return pairs;
}

}  // namespace test_support
