// What fusion keeps of a pixel: 12 bytes, so that one cache line answers a look-up in a neighbouring image and
// many images fit in memory.
#pragma once

#include <cmath>
#include <cstdint>

#include "phi/base/array2d.h"
#include "phi/base/vec.h"

namespace phi {

// A unit vector on the octahedron, 16 bits an axis: exact to 0.005 degrees.
struct PackedNormal {
  std::int16_t x = 0, y = 0;
};

PHI_HD std::int16_t ToSigned16(float v) {
  const float rounded = v * 32767.0f + 0.5f;
  const int toward_zero = static_cast<int>(rounded);
  return static_cast<std::int16_t>(toward_zero - (static_cast<float>(toward_zero) > rounded ? 1 : 0));
}

// The number along one of the axes x and y, of a normal's components along it, along the other and along z. Chosen between, not branched to,
// and one axis at a time: so compilers pack rows of normals in vectors.
PHI_HD std::int16_t PackAxis(float along, float across, float z) {
  const float s = 1.0f / (fabsf(along) + fabsf(across) + fabsf(z));
  const float place = along * s;
  const float folded = (1.0f - fabsf(across * s)) * (place >= 0 ? 1.0f : -1.0f);
  return ToSigned16(z >= 0 ? place : folded);
}

PHI_HD PackedNormal PackNormal(Vec3f n) { return {PackAxis(n.x, n.y, n.z), PackAxis(n.y, n.x, n.z)}; }

// Of a PackedNormal's numbers.
PHI_HD Vec3f UnpackNormal(float packed_x, float packed_y) {
  float x = packed_x * (1.0f / 32767.0f), y = packed_y * (1.0f / 32767.0f);
  const float z = 1.0f - fabsf(x) - fabsf(y);
  const float fold = z < 0 ? -z : 0.0f;
  x += x >= 0 ? -fold : fold;
  y += y >= 0 ? -fold : fold;
  return Normalized({x, y, z});
}

PHI_HD Vec3f UnpackNormal(PackedNormal p) { return UnpackNormal(p.x, p.y); }

struct FusionPixel {
  // Bits of `flags`.
  static constexpr std::uint8_t kInferred = 1;  // depth was inferred by hole filling, not measured
  static constexpr std::uint8_t kEmitted = 2;   // this pixel gave a point of the cloud
  static constexpr std::uint8_t kMerged = 4;    // formulas paper: an earlier image's point took this pixel in

  // As 32-bit words: depth, normal, colour and flags.
  static constexpr int kNumWords = 3, kNormalWord = 1, kColorWord = 2;

  float depth = 0;      // camera z, world units; <= 0 = none
  PackedNormal normal;  // camera frame, facing the camera
  std::uint8_t rgb[3] = {0, 0, 0};
  std::uint8_t flags = 0;
};
static_assert(sizeof(FusionPixel) == FusionPixel::kNumWords * sizeof(std::uint32_t));

using FusionMap = Array2D<FusionPixel>;

}  // namespace phi
