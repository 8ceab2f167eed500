// A plane hypothesis by chance: a random depth from a pixel's range and a random normal that faces the camera.
#pragma once

#include <cstdint>

#include "phi/base/hd.h"
#include "phi/base/random.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/matching/depth_ranges.h"
#include "phi/options.h"

namespace phi {

// Initialisation's place in the random numbers' key; the estimation's own iterations count from zero.
inline constexpr std::uint32_t kInitialIteration = 0xFFFFFFFFu;

// t in [0, 1). robust: uniform in inverse depth, which is how depth errors show in the images. paper: uniform
// in depth.
PHI_HD float DepthInRange(DepthRange range, float t, Formulas formulas) {
  if (formulas == Formulas::kPaper) return range.min + t * (range.max - range.min);
  return 1.0f / (1.0f / range.max + t * (1.0f / range.min - 1.0f / range.max));
}

// `normal` or its opposite, whichever faces the camera. A normal at a right angle to the ray describes a
// plane that no pixel sees: the ray's own direction replaces it.
PHI_HD Vec3f FacingCamera(Vec3f normal, Vec3f ray) {
  const float cosine = Dot(normal, ray) / Norm(ray);
  if (fabsf(cosine) < 1e-3f) return (-1.0f / Norm(ray)) * ray;
  return cosine > 0 ? -1.0f * normal : normal;
}

// Uniform on the sphere (Marsaglia 1972): no trigonometry, so that the CPU and the GPU draw the same bits.
PHI_HD Vec3f RandomUnitVector(RandomKey key, std::uint64_t pixel, std::uint32_t iteration,
                              std::uint32_t first_draw) {
  for (std::uint32_t attempt = 0; attempt < 16; ++attempt) {
    const Random4 random = Philox(key, pixel, iteration, first_draw + attempt);
    for (int k = 0; k < 4; k += 2) {
      const float x = SymmetricFloat(random.v[k]), y = SymmetricFloat(random.v[k + 1]);
      const float s = x * x + y * y;
      if (s >= 1.0f) continue;
      const float root = 2.0f * sqrtf(1.0f - s);
      return {x * root, y * root, 1.0f - 2.0f * s};
    }
  }
  return {0.0f, 0.0f, -1.0f};  // reached with probability 0.215^32
}

// The paper's draw, turned towards the camera: angles are uniform, so that normals crowd around the optical
// axis.
PHI_HD Vec3f RandomNormalOfPaper(Random4 random) {
  constexpr float kPi = 3.14159265358979f;
  const float theta = 2.0f * kPi * UniformFloat(random.v[1]);
  const float phi = 0.5f * kPi * SymmetricFloat(random.v[2]);
  return {cosf(theta) * sinf(phi), sinf(theta) * sinf(phi), -cosf(phi)};
}

// Hypothesis of pixel (x, y) with a depth in `range`, which is known.
PHI_HD PlaneHypothesis RandomHypothesis(const RayModel& k, int x, int y, DepthRange range, RandomKey key, Formulas formulas) {
  const std::uint64_t pixel = static_cast<std::uint64_t>(y) * k.width + x;
  const Random4 random = Philox(key, pixel, kInitialIteration, 0);
  const Vec3f normal = formulas == Formulas::kPaper ? RandomNormalOfPaper(random)
                                                    : RandomUnitVector(key, pixel, kInitialIteration, 1);
  PlaneHypothesis hypothesis;
  hypothesis.depth = DepthInRange(range, UniformFloat(random.v[0]), formulas);
  hypothesis.normal = FacingCamera(normal, k.Ray(x + 0.5f, y + 0.5f));
  return hypothesis;
}

}  // namespace phi
