// Small float vectors for code that runs per pixel on the CPU and on the GPU. Host code in double uses Eigen.
#pragma once

#include <cmath>

#include "phi/base/hd.h"

namespace phi {

struct Vec3f {
  float x = 0, y = 0, z = 0;
};

// Row-major 3x3.
struct Mat3f {
  float m[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
};

PHI_HD Vec3f operator+(Vec3f a, Vec3f b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
PHI_HD Vec3f operator-(Vec3f a, Vec3f b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
PHI_HD Vec3f operator*(float s, Vec3f a) { return {s * a.x, s * a.y, s * a.z}; }
PHI_HD float Dot(Vec3f a, Vec3f b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
PHI_HD Vec3f Cross(Vec3f a, Vec3f b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
PHI_HD float Norm(Vec3f a) { return sqrtf(Dot(a, a)); }
PHI_HD Vec3f Normalized(Vec3f a) { return (1.0f / Norm(a)) * a; }
PHI_HD Vec3f operator*(const Mat3f& a, Vec3f v) {
  return {a.m[0] * v.x + a.m[1] * v.y + a.m[2] * v.z, a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z,
          a.m[6] * v.x + a.m[7] * v.y + a.m[8] * v.z};
}
PHI_HD Vec3f TransposedTimes(const Mat3f& a, Vec3f v) {
  return {a.m[0] * v.x + a.m[3] * v.y + a.m[6] * v.z, a.m[1] * v.x + a.m[4] * v.y + a.m[7] * v.z,
          a.m[2] * v.x + a.m[5] * v.y + a.m[8] * v.z};
}
// Of two numbers. fminf and fmaxf, which a CPU would call a library for.
PHI_HD float Min(float a, float b) {
#ifdef __CUDA_ARCH__
  return fminf(a, b);
#else
  return a < b ? a : b;
#endif
}
PHI_HD float Max(float a, float b) {
#ifdef __CUDA_ARCH__
  return fmaxf(a, b);
#else
  return a > b ? a : b;
#endif
}
// lo for what is no number.
PHI_HD float Clamp(float v, float lo, float hi) { return Min(Max(v, lo), hi); }

}  // namespace phi
