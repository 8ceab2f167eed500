// Vectors of pixels of a run: loads, masks, rotation, packed normals, projection.
// Included once for each instruction set; see support_run.cc.
#if defined(PHI_FUSION_RUN_VECTORS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PHI_FUSION_RUN_VECTORS_INL_H_
#undef PHI_FUSION_RUN_VECTORS_INL_H_
#else
#define PHI_FUSION_RUN_VECTORS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#include "phi/fusion/support_run.h"

HWY_BEFORE_NAMESPACE();
namespace phi {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kRunLength>;
using Ints = hn::RebindToSigned<Floats>;
using Words = hn::RebindToUnsigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;
using VW = hn::Vec<Words>;
using Mask = hn::Mask<Floats>;

constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));

HWY_INLINE VF Set(float value) { return hn::Set(Floats(), value); }
HWY_INLINE VF Load(const float* lanes) { return hn::Load(Floats(), lanes); }
HWY_INLINE void Store(VF v, float* lanes) { hn::Store(v, Floats(), lanes); }

HWY_INLINE Mask FromBits(RunBits bits, int part) {
  const std::uint64_t shifted = bits >> part;
  std::uint8_t bytes[8];
  std::memcpy(bytes, &shifted, sizeof(bytes));
  return hn::LoadMaskBits(Floats(), bytes);
}

HWY_INLINE RunBits ToBits(Mask mask, int part) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(Floats(), mask, bytes);
  RunBits bits;
  std::memcpy(&bits, bytes, sizeof(bits));
  constexpr RunBits kAll = (RunBits{1} << kLanes) - 1;
  return (bits & kAll) << part;
}

// Adds 1 where the mask holds.
HWY_INLINE void Count(Mask mask, std::int32_t* counts) {
  const Ints di;
  hn::Store(hn::Sub(hn::Load(di, counts), hn::BitCast(di, hn::VecFromMask(Floats(), mask))), di, counts);
}

// Structs of vectors write out the constructors that are called: GCC compiles implicit ones without the instruction set that is set
// here, and then cannot inline those of NEON's vectors.
struct Vectors3 {
  VF x, y, z;
  HWY_INLINE Vectors3() {}
  HWY_INLINE Vectors3(VF x, VF y, VF z) : x(x), y(y), z(z) {}
};

HWY_INLINE VF Dot(const Vectors3& a, const Vectors3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

// a * x + b.
HWY_INLINE Vectors3 ScaleAndAdd(VF a, const Vectors3& x, const Vec3f& b) {
  return {hn::Add(hn::Mul(a, x.x), Set(b.x)), hn::Add(hn::Mul(a, x.y), Set(b.y)),
          hn::Add(hn::Mul(a, x.z), Set(b.z))};
}

HWY_INLINE VF RowTimes(float a, float b, float c, const Vectors3& v) {
  return Dot({Set(a), Set(b), Set(c)}, v);
}

HWY_INLINE Vectors3 Rotate(const Mat3f& r, const Vectors3& v) {
  return {RowTimes(r.m[0], r.m[1], r.m[2], v), RowTimes(r.m[3], r.m[4], r.m[5], v),
          RowTimes(r.m[6], r.m[7], r.m[8], v)};
}

HWY_INLINE Vectors3 RotateBack(const Mat3f& r, const Vectors3& v) {
  return {RowTimes(r.m[0], r.m[3], r.m[6], v), RowTimes(r.m[1], r.m[4], r.m[7], v),
          RowTimes(r.m[2], r.m[5], r.m[8], v)};
}

// As phi::UnpackNormal.
HWY_INLINE Vectors3 Unpack(VW packed) {
  const Floats df;
  const VI bits = hn::BitCast(Ints(), packed);
  const VF unit = Set(1.0f / 32767.0f), zero = hn::Zero(df);
  VF x = hn::Mul(hn::ConvertTo(df, hn::ShiftRight<16>(hn::ShiftLeft<16>(bits))), unit);
  VF y = hn::Mul(hn::ConvertTo(df, hn::ShiftRight<16>(bits)), unit);
  const VF z = hn::Sub(hn::Sub(Set(1), hn::Abs(x)), hn::Abs(y));
  const VF fold = hn::IfThenElseZero(hn::Lt(z, zero), hn::Neg(z));
  x = hn::Add(x, hn::IfThenElse(hn::Ge(x, zero), hn::Neg(fold), fold));
  y = hn::Add(y, hn::IfThenElse(hn::Ge(y, zero), hn::Neg(fold), fold));
  const Vectors3 n = {x, y, z};
  const VF scale = hn::Div(Set(1), hn::Sqrt(Dot(n, n)));
  return {hn::Mul(scale, x), hn::Mul(scale, y), hn::Mul(scale, z)};
}

// 1 at no error, 0 at the gate and beyond; smooth, so that a small change of a map changes the support little.
HWY_INLINE VF SoftAgreement(VF error, VF gate) {
  const VF r = hn::Div(error, gate);
  return hn::IfThenElseZero(hn::Lt(r, Set(1)), hn::Sub(Set(1), hn::Mul(r, r)));
}

// Of colours and flags as in FusionPixel.
HWY_INLINE Mask HasFlag(VW color, std::uint8_t flag) {
  return hn::RebindMask(Floats(), hn::TestBit(color, hn::Set(Words(), std::uint32_t{flag} << 24)));
}

struct Projection {
  VF u, v;
  HWY_INLINE Projection() {}
  HWY_INLINE Projection(VF u, VF v) : u(u), v(v) {}
};

HWY_INLINE Projection Project(const RayModel& k, const Vectors3& x) {
  const VF inverse_z = hn::Div(Set(1), x.z);
  return {hn::Add(hn::Mul(hn::Mul(Set(k.fx), x.x), inverse_z), Set(k.cx)),
          hn::Add(hn::Mul(hn::Mul(Set(k.fy), x.y), inverse_z), Set(k.cy))};
}

HWY_INLINE Mask Inside(const RayModel& k, const Vectors3& x, const Projection& p) {
  const VF zero = hn::Zero(Floats());
  const Mask right = hn::And(hn::Ge(p.u, zero), hn::Lt(p.u, Set(static_cast<float>(k.width))));
  const Mask below = hn::And(hn::Ge(p.v, zero), hn::Lt(p.v, Set(static_cast<float>(k.height))));
  return hn::And(hn::Gt(x.z, zero), hn::And(right, below));
}

}  // namespace HWY_NAMESPACE
}  // namespace phi
HWY_AFTER_NAMESPACE();

#endif  // include guard
