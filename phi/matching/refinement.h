// Random refinement of a plane hypothesis (paper section C): a disturbed depth, a disturbed normal, and both.
//
// paper:  depth +- d_max / 4 and angles +- 90 and +- 15 degrees for ever; d_max is the depth of the farthest of the four
//         sparse points around the pixel.
// robust: inverse depth, in which displacement along the epipolar line is linear; ranges shrink to a floor.
#pragma once

#include "phi/base/hd.h"
#include "phi/base/random.h"
#include "phi/geometry/plane_hypothesis.h"
#include "phi/options.h"

namespace phi {

struct RefinementRange {
  float inverse_depth = 0;  // +-, robust: 1 / world unit
  float depth = 0;          // +-, paper: world unit
  float angle = 0;          // +-, robust: radian, tilt of the normal
  Formulas formulas = Formulas::kRobust;
};

// Two axes that complete the unit vector n to an orthonormal frame.
PHI_HD void Perpendicular(Vec3f n, Vec3f* a, Vec3f* b) {
  *a = Normalized(fabsf(n.z) > 0.7f ? Vec3f{0, n.z, -n.y} : Vec3f{n.y, -n.x, 0});
  *b = Cross(n, *a);
}

// Tilts n by a uniform draw from the disc of radius tan(angle) in the tangent plane.
PHI_HD Vec3f TiltNormal(Vec3f n, float angle, std::uint32_t word_radius, std::uint32_t word_direction) {
  const float tilt = tanf(angle) * sqrtf(UniformFloat(word_radius));
  const float direction = 6.28318531f * UniformFloat(word_direction);
  Vec3f a, b;
  Perpendicular(n, &a, &b);
  return Normalized(n + tilt * cosf(direction) * a + tilt * sinf(direction) * b);
}

// The paper's disturbance of the spherical angles of n = (cos t sin p, sin t sin p, cos p).
PHI_HD Vec3f DisturbAngles(Vec3f n, std::uint32_t word_theta, std::uint32_t word_phi) {
  const float theta = atan2f(n.y, n.x) + 1.57079633f * SymmetricFloat(word_theta);
  const float phi = acosf(Clamp(n.z, -1.0f, 1.0f)) + 0.26179939f * SymmetricFloat(word_phi);
  return {cosf(theta) * sinf(phi), sinf(theta) * sinf(phi), cosf(phi)};
}

// The disturbed depth and normal. Where one leaves its domain ([nearest, farthest]; facing the camera) the old one
// stays.
PHI_HD PlaneHypothesis DisturbHypothesis(const PlaneHypothesis& h, const RefinementRange& range, Vec3f ray,
                                         float nearest, float farthest, const Random4& random) {
  PlaneHypothesis out;
  if (range.formulas == Formulas::kPaper) {
    out.depth = h.depth + range.depth * SymmetricFloat(random.v[0]);
    out.normal = DisturbAngles(h.normal, random.v[1], random.v[2]);
  } else {
    out.depth = 1.0f / (1.0f / h.depth + range.inverse_depth * SymmetricFloat(random.v[0]));
    out.normal = TiltNormal(h.normal, range.angle, random.v[1], random.v[2]);
  }
  if (!(out.depth >= nearest && out.depth <= farthest)) out.depth = h.depth;
  if (!FacesCamera(out.normal, ray)) out.normal = h.normal;
  return out;
}

}  // namespace phi
